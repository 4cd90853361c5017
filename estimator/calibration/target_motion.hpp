#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/model/frame_view.hpp"

namespace splid {

// Where a recording's photons go in the pattern period as time passes, whatever the pattern: a
// target that moves by pulse widths smears them, and the pulses that a fold then shows are none.
//
// The recording is cut into up to 64 slices of equal length; each is laid upon those before it at
// the shift that fits best (correlation over the whole circle), staying where it was unless another
// shift is better by six deviations.
//
// Threads: one. Errors: none. At most 33 MB.
class TargetMotion {
 public:
  // period_ps: nominal, > 0; width_ps: of a detected pulse, > 0.
  TargetMotion(double period_ps, double width_ps);

  // Frames that are not locked are passed over.
  void add(const FrameView& frame);

  struct Motion {
    double moved_ps = 0;                 // between the places furthest apart
    double delay_rate_ps_per_s = 0;      // of the straight line through all
    double std_delay_rate_ps_per_s = 0;  // by what is left about it
  };
  // Absent where nothing moves by three bins of about a pulse width, or too few photons tell.
  [[nodiscard]] std::optional<Motion> motion() const;

 private:
  struct Slice {
    std::vector<float> counts;
    std::size_t frames = 0;
    double middle_s = 0;  // sum over its frames, since the first frame
  };

  void merge_pairs();

  std::size_t bins_;
  double bin_ps_;
  std::size_t frames_per_slice_ = 1;
  std::vector<Slice> slices_;
  std::optional<std::int64_t> begin_ps_;
};

}  // namespace splid
