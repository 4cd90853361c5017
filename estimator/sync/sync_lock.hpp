#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "estimator/sync/drift_regression.hpp"

// Which of a frame's sync tags are syncs of one regular line, when the period is known only about:
// strays, doubles, gaps and jitter are sorted out here, before the period is measured.
namespace splid::sync {

inline constexpr std::size_t least_syncs = 3;  // that a line is taken from

// The syncs on a line whose period is within the ratio `drift` of period_ps, or nothing where less
// than 60 % of all lie on such a line. If may_curve, and the clock's rate changes
// significantly within the frame, the line has a quadratic term.
//
// syncs: at least least_syncs times in ps from the fit's origin, nearly sorted. scratch: room for
// as many values as there are syncs.
std::optional<Accepted> lock(std::span<const double> syncs, double period_ps, double drift,
                             bool may_curve, std::span<double> scratch);

}  // namespace splid::sync
