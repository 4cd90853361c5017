#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace splid {

// A guess of the syncs' period from the first 512 gaps between them, for error messages and the
// start of SyncSurvey: the largest T of which nearly all gaps are whole multiples, to within T/16
// and 5 ns at most. Absent where no T fits, or where there are fewer than 8 gaps.
std::optional<double> find_sync_period_ps(std::span<const std::int64_t> syncs_ps);

}  // namespace splid
