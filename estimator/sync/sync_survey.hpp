#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/sync/recording_period.hpp"
#include "estimator/sync/sync_clock.hpp"

namespace splid {

// The period of a recording's syncs where nobody says what it should be: find_sync_period_ps()
// guesses it, SyncClock measures it batch by batch (50 ms, or 16,384 syncs), and RecordingPeriod
// joins the batches. Allocates 56 bytes for each batch.
class SyncSurvey {
 public:
  // In the stream's order.
  void take(std::int64_t sync_ps);

  // To be called once, after the last sync. Absent where no period fits.
  std::optional<MeasuredPeriod> finish();

 private:
  void end_batch();

  std::vector<std::int64_t> batch_ps_;
  std::optional<SyncClock> clock_;
  RecordingPeriod period_;
};

}  // namespace splid
