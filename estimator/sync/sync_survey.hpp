#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "estimator/sync/recording_period.hpp"
#include "estimator/sync/sync_clock.hpp"

namespace splid {

// A guess of the syncs' period from the first 512 gaps between them, for error messages and the
// start of SyncSurvey: the largest T of which nearly all gaps are whole multiples, to within T/16
// and 5 ns at most. Absent where no T fits, or where there are fewer than 8 gaps.
std::optional<double> find_sync_period_ps(std::span<const std::int64_t> syncs_ps);

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
