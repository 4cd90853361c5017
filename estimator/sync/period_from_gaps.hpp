#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace splid {

// A guess of the syncs' period from the gaps between them, where the expected period does not fit:
// the largest T of which nearly all gaps are whole multiples, to within T/16 and 5 ns at most. It
// is for error messages and for the start of SyncSurvey; SyncClock then measures the period.
//
// Looks at the first 512 gaps. Absent where no T fits, or where there are fewer than 8 gaps.
std::optional<double> find_sync_period_ps(std::span<const std::int64_t> syncs_ps);

}  // namespace splid
