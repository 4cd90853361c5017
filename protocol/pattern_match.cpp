#include "protocol/pattern_match.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace splid {
namespace {

constexpr std::size_t max_compared_pulses = 2'000;
constexpr double same_period = 1e-4;

bool are_alike(double a, double b) { return std::abs(a - b) <= same_period * std::max(a, b); }

// Of each pulse of one to each of the other, around the circle of turns, ascending; those of the
// first window once more behind a turn.
std::vector<double> differences_turns(const PatternSegment& a, const PatternSegment& b,
                                      double window) {
  std::vector<double> all;
  all.reserve(a.pulse_times_ps.size() * b.pulse_times_ps.size());
  for (const double from_ps : a.pulse_times_ps) {
    for (const double to_ps : b.pulse_times_ps) {
      const double turns = to_ps / b.period_ps - from_ps / a.period_ps;
      all.push_back(turns - std::floor(turns));
    }
  }
  std::sort(all.begin(), all.end());
  const std::size_t count = all.size();
  for (std::size_t i = 0; i < count && all[i] < window; ++i) all.push_back(all[i] + 1);
  return all;
}

double share_of_segment(const PatternSegment& a, const PatternSegment& b, double window_ps) {
  const std::size_t most = std::max(a.pulse_times_ps.size(), b.pulse_times_ps.size());
  if (most > max_compared_pulses) return a.pulse_times_ps.size() == b.pulse_times_ps.size() ? 1 : 0;
  const double window = window_ps / a.period_ps;
  const std::vector<double> shifts = differences_turns(a, b, window);
  std::size_t together = 0;
  for (std::size_t begin = 0, end = 0; begin < shifts.size(); ++begin) {
    while (end < shifts.size() && shifts[end] - shifts[begin] <= window) ++end;
    together = std::max(together, end - begin);
  }
  return std::min(1.0, static_cast<double>(together) / static_cast<double>(most));
}

}  // namespace

double share_of_same_pulses(const Pattern& a, const Pattern& b, double window_ps) {
  if (a.segments.size() != b.segments.size() ||
      !are_alike(pattern_period_ps(a), pattern_period_ps(b))) {
    return 0;
  }
  double least = 1;
  for (std::size_t s = 0; s < a.segments.size(); ++s) {
    const PatternSegment& one = a.segments[s];
    const PatternSegment& other = b.segments[s];
    const bool same_repeats = a.segments.size() == 1 || one.repeats == other.repeats;
    if (!same_repeats || !are_alike(one.period_ps, other.period_ps)) return 0;
    least = std::min(least, share_of_segment(one, other, window_ps));
  }
  return least;
}

}  // namespace splid
