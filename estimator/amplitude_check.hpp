#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/folded_frame.hpp"
#include "estimator/likelihood.hpp"
#include "estimator/pulse_shape.hpp"
#include "estimator/pulse_train.hpp"

namespace splid {

// Whether the light of a found target's pulses is shared among them as the pattern's amplitudes
// say. It takes a pattern of one stretch and of at least four pulses.
//
// Amplitudes that are wrong bias neither delay nor velocity, but cost significance and a little
// accuracy, and S is then of another pulse than it says.
//
// Threads: one an object. No allocation in misfit().
class AmplitudeCheck {
 public:
  // train: outlives this.
  AmplitudeCheck(const PulseTrain& train, const PulseShape& shape);

  // Relative rms deviation of the pulses' light from the pattern's amplitudes, less what chance
  // makes; absent where it is below 0.1 or six standard deviations of what chance makes of it.
  // found: the fit in this frame. Of more than 65,536 photons an even part is looked at.
  std::optional<double> misfit(const FoldedFrame& frame, const FrameParameters& found);

 private:
  double count_near(const FoldedFrame& frame, DelayLine line);

  const PulseTrain& train_;
  double window_ns_;
  std::vector<CombWindow> windows_;  // of the single stretch, or none
  std::vector<double> counts_;       // photons near each pulse
};

}  // namespace splid
