#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/fold/near_set.hpp"
#include "estimator/likelihood/model.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid::selection {

// Takes the light of targets out of a frame: a photon stays with the chance that the background and
// all light that is not taken out have of the intensity at it. What stays is as if these targets
// were not there: the side lobes of their combs are gone too.
//
// A photon draws its lot by its place in the frame, so that the same frame gives the same rest.
class Thinning {
 public:
  // most_width: how many times as wide as configured a pulse may be.
  Thinning(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons,
           double most_width);

  // The frame without the light of the model's targets, but for the target `kept` (no target's
  // number: without all). It comes without its dead time. Valid until the next call.
  const FoldedFrame& rest(const FoldedFrame& frame, const likelihood::Model& model,
                          std::size_t kept = most_targets);

 private:
  void add_light(const FoldedFrame& frame, const likelihood::Model& model, std::size_t target,
                 std::vector<double>& light);

  const PulseShape& shape_;
  const PulseTrain& train_;
  std::vector<CombWindow> windows_;
  NearSet near_;
  FoldedFrame rest_;
  std::vector<double> taken_, kept_;          // light at each photon of the frame
  std::vector<double> offset_, h_, d1_, d2_;  // scratch: one a photon and pulse
  std::vector<std::uint8_t> stays_;
};

}  // namespace splid::selection
