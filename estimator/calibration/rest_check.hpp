#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/calibration/calibration.hpp"
#include "estimator/calibration/phase_histogram.hpp"
#include "estimator/model/frame_view.hpp"

namespace splid::calibration {

// What the pulses of a calibrated recording did while the recording lasted.
struct RestReport {
  std::size_t frames = 0;
  double seconds = 0;              // from the first frame to the last
  double delay_rate_ps_per_s = 0;  // of the delay, along a straight line through all frames
  double std_delay_rate_ps_per_s = 0;
  double wander_ps = 0;          // rms about that line, less the part of the photons' noise
  double wander_deviations = 0;  // significance of the wander, at the time scale that shows it best

  // By how much the delay changed along that line over the recording.
  [[nodiscard]] double walk_ps() const { return delay_rate_ps_per_s * seconds; }
  [[nodiscard]] bool moves() const;    // along the line, by five deviations
  [[nodiscard]] bool wanders() const;  // about the line, by five deviations
};

// Tells whether a target was at rest in a recording, by how far the photons of each frame lie from
// the calibration's pulses: one Newton step by the score of the likelihood, good to a pulse width
// (TargetMotion sees larger ones). Looks for an even motion, and at time scales from a frame to a
// quarter of the recording for wander beyond the photons' noise. Grows by 24 bytes a frame.
class RestCheck {
 public:
  // fold: that of the recording, from which the calibration came.
  RestCheck(const PhaseHistogram& fold, const Calibration& calibration);

  // To be called with the recording's frames, once more. Frames that are not locked are passed
  // over.
  void add(const FrameView& frame);

  [[nodiscard]] RestReport report() const;

 private:
  struct Shift {
    double time_s;    // since the first frame
    double shift_ps;  // later than the calibration
    double weight;    // 1 / variance, 1/ps^2
  };

  std::size_t bins_;
  std::vector<float> score_;  // d log rate / d shift in each bin of the fold, 1/ps
  double information_ = 0;    // of each photon on average, signal or background, 1/ps^2
  std::vector<Shift> shifts_;
  std::optional<std::int64_t> begin_ps_;
};

}  // namespace splid::calibration
