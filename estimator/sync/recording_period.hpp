#pragma once

#include <cstddef>
#include <vector>

#include "estimator/sync/drift_regression.hpp"
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
// same slope begins; one of a single frame has the slope of its syncs. Grows by some 100 bytes a
// line.
class RecordingPeriod {
 public:
  // Frames that are not locked are passed over.
  void add(const SyncFit& fit);

  [[nodiscard]] MeasuredPeriod period() const;

 private:
  // Frames between which periods can be counted. Their pattern starts are points: the periods since
  // the first of them, and how much later a start is than so many periods of the recording's first
  // frame; weights are 1 / variance, 1/ps^2.
  struct Run {
    sync::Sums sums;
    std::size_t starts = 0;
    sync::Point last;
    SyncFit last_fit;
  };

  std::vector<Run> runs_;
  SyncFit first_;
};

}  // namespace splid
