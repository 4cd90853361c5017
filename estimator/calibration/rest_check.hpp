#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/calibration/calibration.hpp"
#include "estimator/calibration/phase_histogram.hpp"
#include "estimator/model/frame_view.hpp"

// Whether the target of a recording was at rest: TargetMotion sees it move by pulse widths and
// more, RestCheck by less.
namespace splid::calibration {

// How much later the photons of a part of a recording are than those of the whole.
struct Shift {
  double time_s;  // since the first frame
  double later_ps;
  double weight;  // 1 / variance, 1/ps^2
};

// Where a recording's photons go in the pattern period as time passes, for any pattern: a target
// that moves by pulse widths smears them, and the fold shows pulses that were never played. Each of
// up to 64 slices of equal length is laid upon those before it at the shift that fits best, by
// correlation over the circle; it keeps the shift of the last slice unless another one is better by
// six deviations. Takes 33 MB at most.
class TargetMotion {
 public:
  // period_ps: nominal, > 0; width_ps: of a detected pulse, > 0.
  TargetMotion(double period_ps, double width_ps);

  // Frames that are not locked are passed over.
  void add(const FrameView& frame);

  struct Motion {
    double moved_ps = 0;                 // between the places furthest apart
    double delay_rate_ps_per_s = 0;      // of the straight line through all places
    double std_delay_rate_ps_per_s = 0;  // by the spread of the places about that line
  };
  // Absent where nothing moves by two bins, each about a pulse width, or where photons are too
  // few to tell.
  [[nodiscard]] std::optional<Motion> motion() const;

 private:
  struct Slice {
    std::vector<float> counts;
    std::size_t frames = 0;
    double middle_s = 0;  // since the first frame, summed over the slice's frames
  };
  void merge_pairs();

  std::size_t bins_;
  double bin_ps_;
  std::size_t frames_per_slice_ = 1;
  std::vector<Slice> slices_;
  std::optional<std::int64_t> begin_ps_;
};

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

// Tells how far the photons of each frame lie from the calibration's pulses: one Newton step by the
// score of the likelihood, good to a pulse width. Looks for an even motion, and at time scales from
// a frame to a quarter of the recording for wander beyond the photons' noise. Grows by 24 bytes a
// frame.
class RestCheck {
 public:
  // fold: that of the recording, from which the calibration came.
  RestCheck(const PhaseHistogram& fold, const Calibration& calibration);

  // To be called with the recording's frames, once more. Frames that are not locked are passed
  // over.
  void add(const FrameView& frame);

  [[nodiscard]] RestReport report() const;

 private:
  std::vector<float> score_;  // d log rate / d shift in each bin of the fold, 1/ps
  double information_ = 0;    // of each photon on average, signal or background, 1/ps^2
  std::vector<Shift> shifts_;
  std::optional<std::int64_t> begin_ps_;
};

}  // namespace splid::calibration
