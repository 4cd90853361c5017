#include "protocol/pattern.hpp"

#include <array>

namespace splid {
namespace {

constexpr std::array<const char*, 5> mode_names = {"baseline", "ambiguous", "mrr", "random",
                                                   "interleaved"};

}  // namespace

const char* to_string(Mode mode) { return mode_names.at(static_cast<std::size_t>(mode)); }

std::optional<Mode> mode_from_string(const std::string& name) {
  for (std::size_t i = 0; i < mode_names.size(); ++i) {
    if (name == mode_names.at(i)) return static_cast<Mode>(i);
  }
  return std::nullopt;
}

double pattern_period_ps(const Pattern& pattern) {
  if (pattern.segments.size() == 1) return pattern.segments.front().period_ps;
  double period_ps = 0;
  for (const PatternSegment& segment : pattern.segments) {
    period_ps += segment.period_ps * static_cast<double>(segment.repeats);
  }
  return period_ps;
}

std::size_t pulses_per_period(const Pattern& pattern) {
  if (pattern.segments.size() == 1) return pattern.segments.front().pulse_times_ps.size();
  std::size_t pulses = 0;
  for (const PatternSegment& segment : pattern.segments) {
    pulses += segment.pulse_times_ps.size() * static_cast<std::size_t>(segment.repeats);
  }
  return pulses;
}

double amplitude_per_period(const Pattern& pattern) {
  const bool is_one = pattern.segments.size() == 1;
  double all = 0;
  for (const PatternSegment& segment : pattern.segments) {
    double once = 0;
    for (const double amplitude : segment.amplitudes) once += amplitude;
    all += is_one ? once : once * static_cast<double>(segment.repeats);
  }
  return all;
}

double mean_amplitude(const Pattern& pattern) {
  return amplitude_per_period(pattern) / static_cast<double>(pulses_per_period(pattern));
}

}  // namespace splid
