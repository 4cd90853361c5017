#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/calibration/calibration.hpp"
#include "estimator/calibration/phase_histogram.hpp"
#include "estimator/model/frame_view.hpp"

namespace splid {

// What the pulses of a calibrated recording did while it lasted.
struct RestReport {
  std::size_t frames = 0;
  double seconds = 0;              // from the first frame to the last
  double delay_rate_ps_per_s = 0;  // of the delay, along a straight line through all frames
  double std_delay_rate_ps_per_s = 0;
  double wander_ps = 0;          // rms about that line, less what the photons' noise explains
  double wander_deviations = 0;  // how surely it is there: of the time scale that shows it best

  [[nodiscard]] double travel_ps() const { return delay_rate_ps_per_s * seconds; }
  [[nodiscard]] bool moves() const;    // by five deviations
  [[nodiscard]] bool wanders() const;  // by five deviations
};

// Whether a target was at rest in a recording, frame by frame: how far the frame's photons lie from
// the calibration's pulses, by the score of its likelihood (one Newton step from no shift at all,
// good to displacements of a pulse width; see TargetMotion for larger ones). Looks for an even
// motion, and at scales from a frame to a quarter of the recording for wander beyond the photons'
// noise.
//
// Threads: one. Errors: none. Grows by 24 bytes a frame.
class RestCheck {
 public:
  // fold: the recording's, from which the calibration came.
  RestCheck(const PhaseHistogram& fold, const Calibration& calibration);

  // The recording's frames once more. Those that are not locked are passed over.
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
  double information_ = 0;    // of a photon, signal or not, 1/ps^2
  std::vector<Shift> shifts_;
  std::optional<std::int64_t> begin_ps_;
};

}  // namespace splid
