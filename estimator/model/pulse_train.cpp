#include "estimator/model/pulse_train.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/model/units.hpp"

namespace splid {

PulseTrain::PulseTrain(const Pattern& pattern) : period_ns(pattern_period_ps(pattern) * ns_per_ps) {
  double begin_ns = 0;
  closest_ns = period_ns;
  for (const PatternSegment& segment : pattern.segments) {
    const double repeats = pattern.segments.size() == 1 ? 1 : static_cast<double>(segment.repeats);
    const double end_ns = begin_ns + repeats * segment.period_ps * ns_per_ps;
    segments.push_back({Comb(segment), begin_ns, end_ns, 1, {}});
    amplitude_per_ns += repeats * segments.back().comb.total_amplitude;
    pulses_per_ns += repeats * static_cast<double>(segments.back().comb.times_ns.size());
    closest_ns = std::min(closest_ns, segments.back().comb.closest_ns);
    begin_ns = end_ns;
  }
  amplitude_per_ns /= period_ns;
  pulses_per_ns /= period_ns;
  circle_ns = period_ns;
  if (single()) {
    if (pattern.mode == Mode::interleaved) {
      for (const double t_k : pattern.subperiods_ps) {
        segments.front().subperiods_ns.push_back(t_k * ns_per_ps);
      }
    }
    return;
  }
  circle_ns = std::min(period_ns, pattern.unambiguous_delay_ps * ns_per_ps);
  for (Segment& segment : segments) {
    const double copies = std::round(circle_ns / segment.comb.period_ns);
    const bool fits = std::abs(copies * segment.comb.period_ns - circle_ns) < 1e-6 * circle_ns;
    segment.copies = fits ? static_cast<std::uint32_t>(copies) : 0;
  }
}

std::size_t PulseTrain::segment_at(double time_ns) const {
  std::size_t s = 0;
  while (s + 1 < segments.size() && time_ns >= segments[s].end_ns) ++s;
  return s;
}

PulseTrain::Place PulseTrain::place_of(double time_ns) const {
  const std::size_t s = segment_at(time_ns);
  const double turns = (time_ns - segments[s].begin_ns) / segments[s].comb.period_ns;
  return {s, turns - std::floor(turns)};
}

std::vector<double> strong_side_lobes_ns(const PulseTrain& train, double width_ns) {
  if (train.single()) return strong_side_lobes_ns(train.segments.front().comb, 3 * width_ns);
  constexpr std::size_t most_copies = 32;
  const double tolerance_ns = 8 * width_ns;
  const double first_period_ns = train.segments.front().comb.period_ns;
  std::vector<double> copies;
  const auto turns = static_cast<std::size_t>((train.circle_ns - tolerance_ns) / first_period_ns);
  for (std::size_t n = 1; n <= turns; ++n) {
    const double shift = static_cast<double>(n) * first_period_ns;
    double sum_ns = 0;
    double worst_ns = 0;
    for (const PulseTrain::Segment& segment : train.segments) {
      const double off_ns = std::remainder(shift, segment.comb.period_ns);
      sum_ns += off_ns;
      worst_ns = std::max(worst_ns, std::abs(off_ns));
    }
    if (worst_ns > tolerance_ns) continue;
    copies.push_back(shift - sum_ns / static_cast<double>(train.segments.size()));
    if (copies.size() == most_copies) break;
  }
  return copies;
}

std::vector<CombWindow> comb_windows(const PulseTrain& train, double first_ns, double last_ns) {
  std::vector<CombWindow> windows;
  for (const PulseTrain::Segment& segment : train.segments) {
    windows.emplace_back(segment.comb, first_ns, last_ns);
  }
  return windows;
}

std::size_t widest_overlap(std::span<const CombWindow> windows) {
  std::size_t overlap = 1;
  for (const CombWindow& window : windows) overlap = std::max(overlap, window.max_overlap());
  return overlap;
}

}  // namespace splid
