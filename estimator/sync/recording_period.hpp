#pragma once

#include <cstdint>
#include <vector>

#include "estimator/sync/sync_fit.hpp"

namespace splid {

// A pattern period that was measured over a recording.
struct MeasuredPeriod {
  double period_ps = 0;      // tagger's clock; 0 before any locked frame
  double std_period_ps = 0;  // holds what the clocks' wander about the line adds
};

// The pattern period over a whole recording: the least-squares line through the pattern starts that
// the fits of the frames give ([P] Eq. 19 has the period of one frame, see drift_regression.hpp).
// Periods are counted from frame to frame. Where a gap is too long to say how many periods it has,
// or where the clock was set anew, a new line of the same slope begins.
//
// Threads: one. Errors: none. Grows by 40 bytes for each frame.
class RecordingPeriod {
 public:
  // Frames that are not locked are passed over.
  void add(const SyncFit& fit);
  // The generator began again: the next frame is no whole number of periods after the last frame.
  void cut() { is_cut_ = true; }

  [[nodiscard]] MeasuredPeriod period() const;

 private:
  // A pattern start, relative to the first start of its run, in periods of the first frame.
  struct Start {
    std::uint32_t run;  // frames between which periods can be counted
    double k;           // periods since the run's first start
    double excess_ps;   // how much later it is than k periods of the first frame
    double weight;      // 1 / variance, 1/ps^2
  };

  std::vector<Start> starts_;
  SyncFit last_;
  bool is_cut_ = false;
  double first_period_ps_ = 0;
  double first_std_period_ps_ = 0;
};

}  // namespace splid
