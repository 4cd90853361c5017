#include "protocol/pattern_make.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/json_writer.hpp"

namespace splid {
namespace {

// Design note: a pattern of more than a million pulses, or longer than a second, is a slip of the
// pen (180.001 and 189 ns have a least common multiple of 34 ms). No waveform generator holds it,
// and a frame would see less than one period of it.
constexpr std::size_t most_made_pulses = 1'000'000;
constexpr std::int64_t longest_made_ps = 1'000'000'000'000;

[[noreturn]] void refuse(const std::string& what) { throw Error(Fault::usage, "pattern: " + what); }

void check_period(double period_ps) {
  if (period_ps > 0 && period_ps <= static_cast<double>(longest_made_ps)) return;
  refuse("a period of " + number_text(period_ps) +
         " ps; it must be above 0 and at most 1e12 ps (1 s)");
}

void check_pulses(std::size_t pulses) {
  if (pulses >= 1 && pulses <= most_made_pulses) return;
  refuse(std::to_string(pulses) + " pulses; there must be from 1 to 1000000");
}

std::int64_t whole_ps(double period_ps) {
  check_period(period_ps);
  if (period_ps == std::floor(period_ps)) return static_cast<std::int64_t>(period_ps);
  refuse("a period of " + number_text(period_ps) +
         " ps; it must be a whole number of picoseconds, so "
         "that the periods have a common multiple");
}

std::vector<std::int64_t> different_periods_ps(std::span<const double> periods_ps) {
  if (periods_ps.size() < 2) refuse("one period given; this mode needs two or more");
  std::vector<std::int64_t> whole;
  for (const double period_ps : periods_ps) whole.push_back(whole_ps(period_ps));
  std::vector<std::int64_t> sorted = whole;
  std::sort(sorted.begin(), sorted.end());
  const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
  if (twice != sorted.end()) {
    refuse("the period " + std::to_string(*twice) + " ps is given twice; they must be different");
  }
  return whole;
}

std::int64_t common_multiple_ps(const std::vector<std::int64_t>& periods_ps) {
  std::int64_t multiple_ps = 1;
  for (const std::int64_t period_ps : periods_ps) {
    const std::int64_t factor = period_ps / std::gcd(multiple_ps, period_ps);
    if (factor > longest_made_ps / multiple_ps) {
      refuse(
          "the least common multiple of the periods is above 1e12 ps (1 s); choose periods with "
          "a large common divisor, such as 180000 and 189000 ps");
    }
    multiple_ps *= factor;
  }
  return multiple_ps;
}

Pattern of_one_segment(Mode mode, double period_ps, std::vector<double> times_ps) {
  Pattern pattern;
  pattern.mode = mode;
  pattern.unambiguous_delay_ps = period_ps;
  PatternSegment segment;
  segment.period_ps = period_ps;
  segment.amplitudes.assign(times_ps.size(), 1.0);
  segment.pulse_times_ps = std::move(times_ps);
  pattern.segments.push_back(std::move(segment));
  return pattern;
}

// Uniform in [0, bound), with the same numbers on every platform, which the distributions of the
// standard library do not promise.
std::uint64_t draw_below(std::mt19937_64& random, std::uint64_t bound) {
  const std::uint64_t fair = std::mt19937_64::max() - std::mt19937_64::max() % bound;
  std::uint64_t drawn = random();
  while (drawn >= fair) drawn = random();
  return drawn % bound;
}

}  // namespace

Pattern make_periodic(Mode mode, double period_ps, std::size_t pulses) {
  if (mode != Mode::baseline && mode != Mode::ambiguous) {
    refuse(std::string("mode ") + to_string(mode) +
           " is not periodic; it must be baseline or "
           "ambiguous");
  }
  check_period(period_ps);
  check_pulses(pulses);
  std::vector<double> times_ps;
  for (std::size_t i = 0; i < pulses; ++i) {
    times_ps.push_back(period_ps * static_cast<double>(i) / static_cast<double>(pulses));
  }
  Pattern pattern = of_one_segment(mode, period_ps, std::move(times_ps));
  pattern.unambiguous_delay_ps = period_ps / static_cast<double>(pulses);
  return pattern;
}

Pattern make_interleaved(std::span<const double> subperiods_ps) {
  const std::vector<std::int64_t> periods_ps = different_periods_ps(subperiods_ps);
  const std::int64_t period_ps = common_multiple_ps(periods_ps);
  std::vector<std::int64_t> times_ps;
  for (const std::int64_t step_ps : periods_ps) {
    check_pulses(times_ps.size() + static_cast<std::size_t>(period_ps / step_ps));
    for (std::int64_t t_ps = 0; t_ps < period_ps; t_ps += step_ps) times_ps.push_back(t_ps);
  }
  std::sort(times_ps.begin(), times_ps.end());
  times_ps.erase(std::unique(times_ps.begin(), times_ps.end()), times_ps.end());
  Pattern pattern = of_one_segment(Mode::interleaved, static_cast<double>(period_ps),
                                   {times_ps.begin(), times_ps.end()});
  pattern.subperiods_ps.assign(subperiods_ps.begin(), subperiods_ps.end());
  return pattern;
}

// Design note: drawing pulse by pulse, and drawing again where two are too close, does not end when
// 40 pulses of 9 ns share 400 ns. Instead the spare time (the period less the number of pulses
// times the spacing) is cut at uniformly drawn, sorted places, and the spacing is put back between
// them. Every allowed set is then equally likely, at any density, without drawing twice.
Pattern make_random(const RandomPatternOptions& options) {
  const std::int64_t period_ps = whole_ps(options.period_ps);
  check_pulses(options.pulses);
  if (!(options.min_spacing_ps >= 1) || options.min_spacing_ps > options.period_ps) {
    refuse("a spacing of " + number_text(options.min_spacing_ps) +
           " ps; it must be at least 1 ps and at most the period");
  }
  const auto spacing_ps = static_cast<std::int64_t>(std::ceil(options.min_spacing_ps));
  const auto pulses = static_cast<std::int64_t>(options.pulses);
  if (spacing_ps > period_ps / pulses) {
    refuse(std::to_string(pulses) + " pulses " + std::to_string(spacing_ps) +
           " ps apart do not fit into " + std::to_string(period_ps) + " ps; at most " +
           std::to_string(period_ps / spacing_ps) + " do");
  }
  std::mt19937_64 random(options.seed);
  const auto spare_ps = static_cast<std::uint64_t>(period_ps - pulses * spacing_ps);
  std::vector<std::uint64_t> cuts_ps = {0};
  for (std::int64_t i = 1; i < pulses; ++i) cuts_ps.push_back(draw_below(random, spare_ps + 1));
  std::sort(cuts_ps.begin(), cuts_ps.end());
  std::vector<double> times_ps;
  for (std::int64_t i = 0; i < pulses; ++i) {
    const auto cut_ps = static_cast<std::int64_t>(cuts_ps[static_cast<std::size_t>(i)]);
    times_ps.push_back(static_cast<double>(cut_ps + i * spacing_ps));
  }
  return of_one_segment(Mode::random, options.period_ps, std::move(times_ps));
}

Pattern make_stratified(const RandomPatternOptions& options) {
  const std::int64_t period_ps = whole_ps(options.period_ps);
  check_pulses(options.pulses);
  const auto pulses = static_cast<std::int64_t>(options.pulses);
  if (pulses > period_ps) {
    refuse(std::to_string(pulses) + " pulses in " + std::to_string(period_ps) +
           " ps; there is at most one a picosecond");
  }
  std::mt19937_64 random(options.seed);
  std::vector<double> times_ps;
  for (std::int64_t i = 0; i < pulses; ++i) {
    const std::int64_t begin_ps = i * period_ps / pulses;
    const auto slot_ps = static_cast<std::uint64_t>((i + 1) * period_ps / pulses - begin_ps);
    times_ps.push_back(static_cast<double>(begin_ps) +
                       static_cast<double>(draw_below(random, slot_ps)));
  }
  return of_one_segment(Mode::random, options.period_ps, std::move(times_ps));
}

Pattern make_mrr(std::span<const double> periods_ps, std::span<const std::int64_t> repeats) {
  const std::vector<std::int64_t> whole = different_periods_ps(periods_ps);
  if (repeats.size() != periods_ps.size()) {
    refuse(std::to_string(repeats.size()) + " repeat counts for " +
           std::to_string(periods_ps.size()) + " periods; each period needs one");
  }
  Pattern pattern;
  pattern.mode = Mode::mrr;
  pattern.unambiguous_delay_ps = static_cast<double>(common_multiple_ps(whole));
  pattern.subperiods_ps.assign(periods_ps.begin(), periods_ps.end());
  std::int64_t left_ps = longest_made_ps;
  for (std::size_t k = 0; k < periods_ps.size(); ++k) {
    if (repeats[k] < 1 || repeats[k] > left_ps / whole[k]) {
      refuse(std::to_string(repeats[k]) + " repeats of " + std::to_string(whole[k]) +
             " ps; there must be at least 1, and together at most 1e12 ps (1 s)");
    }
    left_ps -= repeats[k] * whole[k];
    pattern.segments.push_back({periods_ps[k], {0}, {1}, repeats[k]});
  }
  if (const auto fault = validate(pattern)) refuse(*fault);  // such as too many periods
  return pattern;
}

}  // namespace splid
