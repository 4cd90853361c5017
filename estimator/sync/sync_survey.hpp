#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/sync/sync_clock.hpp"
#include "estimator/sync/sync_line.hpp"

namespace splid {

// The period of a recording's syncs where nobody says what it should be: what find_sync_period_ps()
// makes of the first of them is measured by the frames' own SyncClock, stretch by stretch, and
// these by SyncLine. Doubled, missing and stray syncs come out right as they do there.
//
// Threads: one. Errors: none. Allocates 40 bytes a stretch (50 ms, or 16,384 syncs).
class SyncSurvey {
 public:
  // In the stream's order.
  void take(std::int64_t sync_ps);

  // After the last. Absent: no period fits.
  std::optional<SyncLine::Period> finish();

 private:
  void end_stretch();

  std::vector<std::int64_t> stretch_ps_;
  std::optional<SyncClock> clock_;
  SyncFit last_;  // of the last stretch that locked
  SyncLine line_;
};

}  // namespace splid
