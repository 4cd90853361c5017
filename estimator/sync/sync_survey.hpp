#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "estimator/sync/recording_period.hpp"

namespace splid {

// A guess of the syncs' period from the first 512 gaps between them, for error messages and
// survey_period(): the largest T of which most gaps are whole multiples, to within T/16 and 5 ns at
// most. Absent where no T fits, or where there are fewer than 8 gaps.
std::optional<double> find_sync_period_ps(std::span<const std::int64_t> syncs_ps);

// The period of a recording's syncs where nobody says what it should be: find_sync_period_ps()
// guesses it, and SyncClock measures it, of the first 16,384 syncs in a row that lie on one line
// (10 ps of jitter leave 1e-5 ps). syncs_ps: in the stream's order. Absent where no period fits.
std::optional<MeasuredPeriod> survey_period(std::span<const std::int64_t> syncs_ps);

}  // namespace splid
