#pragma once

#include "estimator/sync/sync_fit.hpp"

namespace splid {

// A pattern period that was measured over a recording.
struct MeasuredPeriod {
  double period_ps = 0;      // tagger's clock; 0 before any locked frame
  double std_period_ps = 0;  // holds what the clocks' wander from frame to frame adds
};

// The pattern period over a whole recording: the mean of the periods of its frames, weighted by
// their deviations. Pauses, clocks that are set anew and generators that begin again do no harm.
class RecordingPeriod {
 public:
  // Frames that are not locked are passed over.
  void add(const SyncFit& fit);

  [[nodiscard]] MeasuredPeriod period() const;

 private:
  double first_ps_ = 0;  // the period of the first frame, which the sums are relative to
  double fits_ = 0, weights_ = 0, excess_ = 0, squares_ = 0;
};

}  // namespace splid
