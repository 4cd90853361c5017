#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "estimator/checks/finding_sums.hpp"
#include "estimator/checks/findings.hpp"
#include "estimator/likelihood/maximizer.hpp"
#include "estimator/model/frame_view.hpp"

namespace splid::checks {

// What is looked for beyond the fitted model, in each frame and over the last ones.
class FrameChecks {
 public:
  // dead_time_ns: where it is modelled; else 0. reach_ns: of the frames.
  FrameChecks(const PulseTrain& train, const PulseShape& shape, std::size_t max_photons,
              double dead_time_ns, double reach_ns);

  // Judges each target of a fitted model. track_terms: that were free in the fit.
  std::array<Verdict, most_targets> judge(const FrameView& view, const FoldedFrame& frame,
                                          const likelihood::Maximum& fitted,
                                          std::size_t track_terms);
  // Takes the light at single places of the pattern's period, as a pick-up of the syncs makes it,
  // out of a frame whose best target is none. The search takes it for a target whose other pulses
  // are dark, and a target of less light beside it is not seen. target: of the frame that was
  // judged last. Empty, and the frame is unchanged, where no pulse has far more light than most
  // others, or many have.
  std::optional<Finding> take_stray_light(FoldedFrame& frame, const DelayTrack& target);
  // Gives a frame the light back that was taken out of it.
  void put_back(FoldedFrame& frame) { std::swap(cleaned_, frame); }

  // Adds the frame that was judged last, and returns what the last 50 to 100 frames show together.
  const FoundList& sum_up(const FoldedFrame& frame);

 private:
  const PulseTrain& train_;
  double pulse_reach_ns_;
  Findings findings_;
  std::array<FindingSums, 2> sums_;  // begun 50 frames apart
  std::size_t older_ = 0;
  FoundList recent_;
  std::vector<double> sorted_;       // scratch: photons by pulse
  std::vector<std::uint8_t> stays_;  // scratch: what is not stray, one a photon
  FoldedFrame cleaned_;
};

}  // namespace splid::checks
