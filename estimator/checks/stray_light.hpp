#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "estimator/checks/residual_map.hpp"
#include "estimator/fold/delay_track.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/finding.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid::checks {

// Light that comes at one place of the pattern's period, as a pick-up of the syncs does. The search
// takes it for a target whose other pulses are dark, and a target of less light beside it is not
// seen.
class StrayLight {
 public:
  StrayLight(const PulseTrain& train, double width_ns, std::size_t max_photons);
  // Looks for pulses of a track that have far more light than most others. map: of this frame,
  // about the track. Empty where no pulse has, or many have.
  std::optional<Finding> look(const ResidualMap& map, const FoldedFrame& frame,
                              const DelayTrack& track);
  // The frame without that light: for FoldedFrame::take_some().
  [[nodiscard]] std::span<const std::uint8_t> stays() const { return stays_; }

 private:
  const PulseTrain& train_;
  double reach_ns_;
  std::vector<double> sorted_;
  std::vector<std::uint8_t> stays_;
};

}  // namespace splid::checks
