#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>

#include "estimator/sync/drift_regression.hpp"

// Whether the syncs of a frame depart from a line, from a sample of them: 512 syncs tell it to a
// fifth of the syncs' jitter, and cost next to nothing. Outliers are rejected about a line that
// curves as the clock does, or else those syncs that depart the most would pass for outliers.
namespace splid::sync {

// Design note: while the line is still unknown, a sync may be off its place by a 16th of the
// period, and by 5 ns at most. 5 ns is ten times the jitter of a bad sync input. Of syncs at random
// an eighth fit a window of +-T/16, which is far from the 60 % that sync_lock.cpp asks for.
inline constexpr double window_of_period = 1.0 / 16;
inline double first_window_ps(double period_ps) {
  return std::min(period_ps * window_of_period, 5000.0);
}

// A sync so close behind another is a reflection of it, or the cable rings. Where every sync has
// such a double, the doubles are as regular as the true syncs, and late.
inline bool is_double(std::span<const double> syncs, std::size_t i, double period_ps) {
  return i > 0 && syncs[i] - syncs[i - 1] < period_ps * window_of_period;
}

// The standard deviation of gaussian values, by the median of their absolute deviations, whose
// order is lost; at least least_sigma_ps. deviations_ps: not empty.
double robust_sigma_ps(std::span<double> deviations_ps);

// How syncs depart from a line, by the median of each 16th of them.
struct Departure {
  // The line through the medians, curved where they curve by more than chance: known to 0.2 sigma
  // at the ends of the sampled syncs, and over four times their length to 100 ps for 10 ps of
  // jitter.
  Line line;
  double sigma_ps = 0;  // robust, of the syncs about their 16th's median
  // How far apart the medians are, about a straight line, where neither a line nor a parabola
  // explains them: the syncs wander, or jump. Else 0.
  double wander_ps = 0;
};

// Nothing where the syncs are less than 64, or where most are far from the line.
std::optional<Departure> departure(std::span<const double> syncs, const Line& line);

}  // namespace splid::sync
