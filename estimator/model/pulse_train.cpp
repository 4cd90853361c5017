#include "estimator/model/pulse_train.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/model/units.hpp"

namespace splid {

PulseTrain::PulseTrain(const Pattern& pattern) : period_ns(pattern_period_ps(pattern) * ns_per_ps) {
  double begin_ns = 0;
  double amplitude = 0;
  double pulses = 0;
  closest_ns = period_ns;
  for (const PatternSegment& segment : pattern.segments) {
    const double repeats = pattern.segments.size() == 1 ? 1 : static_cast<double>(segment.repeats);
    const double end_ns = begin_ns + repeats * segment.period_ps * ns_per_ps;
    segments.push_back({Comb(segment), begin_ns, end_ns, 1, {}});
    amplitude += repeats * segments.back().comb.total_amplitude;
    pulses += repeats * static_cast<double>(segments.back().comb.times_ns.size());
    closest_ns = std::min(closest_ns, segments.back().comb.closest_ns);
    begin_ns = end_ns;
  }
  amplitude_per_ns = amplitude / period_ns;
  pulses_per_ns = pulses / period_ns;
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

CombMeetings::CombMeetings(const PulseTrain& train, double width_ns)
    : circle_ns_(train.circle_ns), tolerance_ns_(3 * width_ns) {
  if (train.single()) {
    periods_ns_ = train.segments.front().subperiods_ns;
  } else {
    for (const PulseTrain::Segment& segment : train.segments) {
      if (segment.comb.times_ns.size() == 1) periods_ns_.push_back(segment.comb.period_ns);
    }
    if (periods_ns_.size() < train.segments.size()) periods_ns_.clear();
  }
  if (periods_ns_.size() < 2) periods_ns_.clear();
}

CombMeetings::Places CombMeetings::find(double one_ns, double other_ns) const {
  Places places;
  if (periods_ns_.empty()) return places;
  const double period_ns = periods_ns_.front();
  const auto turns = static_cast<std::size_t>(std::ceil(circle_ns_ / period_ns));
  for (const double from_ns : {one_ns, other_ns}) {
    for (std::size_t n = 0; n < turns && !places.is_full(); ++n) {
      double place_ns = from_ns + static_cast<double>(n) * period_ns;
      double off_ns = 0;
      if (!meets_at(place_ns, one_ns, other_ns, off_ns)) continue;
      place_ns += off_ns;
      place_ns -= circle_ns_ * std::floor(place_ns / circle_ns_);
      const auto is_here = [&](double delay_ns) { return is_same(place_ns, delay_ns); };
      const auto known = places.delays_ns();
      if (is_here(one_ns) || is_here(other_ns)) continue;
      if (std::none_of(known.begin(), known.end(), is_here)) places.add(place_ns);
    }
  }
  return places;
}

bool CombMeetings::do_meet(double one_ns, double other_ns, double place_ns) const {
  const Places places = find(one_ns, other_ns);
  const auto delays_ns = places.delays_ns();
  return std::any_of(delays_ns.begin(), delays_ns.end(),
                     [&](double delay_ns) { return is_same(delay_ns, place_ns); });
}

bool CombMeetings::is_same(double one_ns, double other_ns) const {
  return std::abs(std::remainder(one_ns - other_ns, circle_ns_)) < 2 * tolerance_ns_;
}

// Whether each rate has its pulses at one of the two there, and not all at the same one, or close
// to them as those of a nearly even comb's copies are. off_ns: how far off their mean is.
bool CombMeetings::meets_at(double place_ns, double one_ns, double other_ns, double& off_ns) const {
  bool all_one = true, all_other = true;
  off_ns = 0;
  for (const double period_ns : periods_ns_) {
    const double to_one = std::remainder(one_ns - place_ns, period_ns);
    const double to_other = std::remainder(other_ns - place_ns, period_ns);
    const double nearest = std::abs(to_one) < std::abs(to_other) ? to_one : to_other;
    if (std::abs(nearest) > tolerance_ns_) return false;
    all_one = all_one && std::abs(to_one) <= 2 * tolerance_ns_;
    all_other = all_other && std::abs(to_other) <= 2 * tolerance_ns_;
    off_ns += nearest / static_cast<double>(periods_ns_.size());
  }
  return !all_one && !all_other;
}

}  // namespace splid
