#pragma once

#include <cstddef>
#include <cstdint>

#include "estimator/model/frame_view.hpp"

namespace splid {

// [P] Eq. 20: the times of a frame's photons, corrected for the drift of the pattern's clock. A
// time since mid-frame in the tagger's clock, over `scale`, is the time in the clock of the
// calibrated pattern, where
//   scale = measured pattern period (Eq. 19, estimator/sync/drift_regression.hpp) over calibrated
// The same line through the syncs gives the photon's phase: the time since the last pattern start.
//
// Design note: times are formed with whole picoseconds up to mid-frame, and are doubles from there
// on, so that an epoch of 3.4e17 ps costs no picosecond: those of a frame of 50 ms are exact.
//
// Threads: const, any. Errors: none. Allocates nothing.
class DriftCorrection {
 public:
  // frame: locked to its syncs, outlives this. period_ns: of the calibrated pattern, > 0.
  DriftCorrection(const FrameView& frame, double period_ns);

  [[nodiscard]] double scale() const { return scale_; }
  // The duration of the frame in the pattern's clock.
  [[nodiscard]] double length_ns() const { return length_ns_; }

  // Writes for each photon of the frame its time from mid-frame, its phase in [0, period_ns), and
  // that phase in 2^-32 of a period. Each array has room for all photons.
  void correct(double* times_ns, double* phases_ns, std::uint32_t* phases_32) const;

 private:
  const FrameView& frame_;
  std::int64_t mid_ps_;
  double period_ns_;
  double scale_;
  double to_ns_;  // from the tagger's ps
  double length_ns_;
};

}  // namespace splid
