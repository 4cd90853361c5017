#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace splid {

// The period that best explains the gaps between syncs when the expected one does not, for the
// error message: the largest T of which nearly all gaps are whole multiples, to within T/16 and at
// most 5 ns. Looks at the first 512 gaps; absent where no T fits or there are fewer than 8 gaps.
//
// Threads: any. Errors: none. Allocates nothing.
std::optional<double> find_sync_period_ps(std::span<const std::int64_t> syncs_ps);

}  // namespace splid
