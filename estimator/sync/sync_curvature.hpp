#pragma once

#include <algorithm>
#include <array>
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
inline constexpr double widest_window_ps = 5000;

// Where nearly all agree, the others are strays.
inline constexpr double nearly_all = 0.9;

inline constexpr double sigma_per_mad = 1.4826;  // of a gaussian: sigma over median deviation

inline double first_window_ps(double period_ps) {
  return std::min(period_ps * window_of_period, widest_window_ps);
}

// A sync so close behind another is a reflection of it, or the cable rings. Where every sync has
// such a double, the doubles are as regular as the true syncs, and late.
inline bool is_double(std::span<const double> syncs, std::size_t i, double period_ps) {
  return i > 0 && syncs[i] - syncs[i - 1] < period_ps * window_of_period;
}

// How far from a line the syncs of each 16th of them are. Those 16ths in which most syncs are far
// from the line are left out.
struct BlockMedians {
  static constexpr std::size_t most = 16;

  std::size_t count = 0;
  std::array<double, most> at_ps, off_ps;  // the mean time of a 16th, and its median distance
  double sigma_ps = 0;                     // robust, of the syncs about their 16th's median
  double std_ps = 0;                       // of a median

  // The farthest median from the mean of them, or 0 where chance explains it.
  [[nodiscard]] double farthest_ps() const;
};

// Nothing where the syncs are less than 64, or where most are far from the line.
std::optional<BlockMedians> block_medians(std::span<const double> syncs, const Line& line);

// The line through the medians, curved where they curve by more than chance: known to 0.2 sigma at
// the ends of the sampled syncs, and over four times their length to 100 ps for 10 ps of jitter.
std::optional<Line> curved_line(std::span<const double> syncs, Line line);

// How far apart the medians are, about a straight line, where neither a line nor a parabola
// explains them: the syncs wander, or jump. Else 0.
double wander_ps(std::span<const double> syncs, const Line& line);

// Whether most are near the line, and no median is off it, nor the medians curved, by more than
// chance.
bool is_straight(std::span<const double> syncs, const Line& line);

}  // namespace splid::sync
