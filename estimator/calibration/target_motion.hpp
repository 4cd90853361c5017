#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/model/frame_view.hpp"

namespace splid::calibration {

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
  // Absent where nothing moves by three bins, each about a pulse width, or where photons are too
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

}  // namespace splid::calibration
