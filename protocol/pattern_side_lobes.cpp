#include "protocol/pattern_side_lobes.hpp"

#include <algorithm>
#include <vector>

namespace splid {
namespace {

constexpr std::size_t max_side_lobe_pulses = 2'000;

// Of each pulse to each other, around the circle, in (0, period), ascending.
std::vector<double> differences_ps(const PatternSegment& segment) {
  std::vector<double> all;
  all.reserve(segment.pulse_times_ps.size() * segment.pulse_times_ps.size());
  for (const double from_ps : segment.pulse_times_ps) {
    for (const double to_ps : segment.pulse_times_ps) {
      if (to_ps == from_ps) continue;
      all.push_back(to_ps > from_ps ? to_ps - from_ps : to_ps - from_ps + segment.period_ps);
    }
  }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

std::optional<SideLobe> highest_side_lobe(const Pattern& pattern, double window_ps) {
  if (pattern.segments.size() != 1) return std::nullopt;
  const PatternSegment& segment = pattern.segments.front();
  const std::size_t pulses = segment.pulse_times_ps.size();
  if (pulses < 2 || pulses > max_side_lobe_pulses) return std::nullopt;
  const std::vector<double> shifts_ps = differences_ps(segment);
  SideLobe highest;
  for (std::size_t begin = 0, end = 0; begin < shifts_ps.size(); ++begin) {
    while (end < shifts_ps.size() && shifts_ps[end] - shifts_ps[begin] <= window_ps) ++end;
    if (end - begin <= highest.pairs) continue;
    highest.pairs = end - begin;
    highest.shift_ps = (shifts_ps[begin] + shifts_ps[end - 1]) / 2;
  }
  highest.relative = static_cast<double>(highest.pairs) / static_cast<double>(pulses);
  return highest;
}

}  // namespace splid
