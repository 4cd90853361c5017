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
// the fits of the frames give. Periods are counted from frame to frame. After a pause of some
// frames' lengths, and where a clock was set anew or the generator began again, a new line of the
// same slope begins; one of a single frame has the slope of its syncs. Grows by 56 bytes a frame.
class RecordingPeriod {
 public:
  // Frames that are not locked are passed over.
  void add(const SyncFit& fit);

  [[nodiscard]] MeasuredPeriod period() const;

 private:
  // A pattern start, relative to the first start of its run, in periods of the first frame.
  struct Start {
    std::uint32_t run;        // frames between which periods can be counted
    double k;                 // periods since the run's first start
    double excess_ps;         // how much later it is than k periods of the first frame
    double weight;            // 1 / variance, 1/ps^2
    double period_excess_ps;  // of the frame's own period over that of the first frame
    double std_period_ps;
  };

  std::vector<Start> starts_;
  SyncFit last_;
  double first_period_ps_ = 0;
  double first_std_period_ps_ = 0;
};

}  // namespace splid
