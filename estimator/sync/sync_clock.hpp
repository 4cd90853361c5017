#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/sync/sync_fit.hpp"

// The room sync/ measures the clock that the pattern is played by, from the tags of the pattern's
// syncs. Open this file first. Its parts:
//   sync_fit.hpp           the result for one frame
//   drift_regression.hpp   the period that a line through the syncs has: [P] Eq. 19
//   sync_lock.hpp          which of the tags are syncs of one line, and about where that line is
//   sync_curvature.hpp     whether they depart from a line, as where the clock's rate changes
//   recording_period.hpp   one period for a whole recording, from the fits of its frames
//   sync_survey.hpp        that period where nobody says what it should be
// The period is applied to the photons' times ([P] Eq. 20) in estimator/fold/folded_frame.cpp.

namespace splid {

// Fits the pattern's clock to the syncs of one frame after the other. Syncs are counted by time, so
// that missing, doubled and stray syncs do no harm. A fit that fails is not locked. No allocation
// after construction for frames of up to max_syncs; of more syncs an even subset is used. Remembers
// the last period that it locked to, and nothing else.
class SyncClock {
 public:
  // calibrated_period_ps: > 0, the pattern period of the calibration, or the nominal one, in the
  // tagger's clock. max_drift_ppm: how far the measured period may be from it.
  SyncClock(double calibrated_period_ps, DriftMethod method, std::size_t max_syncs,
            double max_drift_ppm = 500);

  // syncs_ps: nearly sorted, in [begin_ps, end_ps), which is the frame. Source: [P] Eq. 19.
  SyncFit fit(std::span<const std::int64_t> syncs_ps, std::int64_t begin_ps, std::int64_t end_ps);

  // The best period known: that of the last locked fit, or the calibrated one.
  [[nodiscard]] double period_ps() const { return period_ps_; }
  void reset() { period_ps_ = calibrated_period_ps_; }

 private:
  double calibrated_period_ps_;
  DriftMethod method_;
  double max_drift_ppm_;
  double period_ps_;
  std::vector<double> position_;  // scratch: the syncs' times from the origin, ps
  std::vector<double> residual_;  // scratch: their distances from the line, ps
};

}  // namespace splid
