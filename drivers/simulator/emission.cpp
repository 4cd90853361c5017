#include "drivers/simulator/emission.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace splid::simulator {

EmissionSchedule::EmissionSchedule(const Pattern& pattern) {
  double begin_ps = 0;
  for (const PatternSegment& given : pattern.segments) {
    Segment segment{begin_ps, given.period_ps, amplitude_, 0, 1, given.pulse_times_ps, {}};
    // A single segment is looped, whatever its repeats.
    if (pattern.segments.size() > 1) segment.repeats = static_cast<double>(given.repeats);
    for (const double amplitude : given.amplitudes) {
      segment.amplitude += amplitude;
      segment.accumulated.push_back(segment.amplitude);
    }
    begin_ps += segment.period_ps * segment.repeats;
    amplitude_ += segment.amplitude * segment.repeats;
    if (segment.amplitude > 0) segments_.push_back(std::move(segment));
  }
}

double EmissionSchedule::pulse_time_ps(double accumulated) const {
  auto segment = std::upper_bound(
      segments_.begin() + 1, segments_.end(), accumulated,
      [](double value, const Segment& candidate) { return value < candidate.begin_amplitude; });
  --segment;
  double within = accumulated - segment->begin_amplitude;
  const double repeat =
      std::clamp(std::floor(within / segment->amplitude), 0.0, segment->repeats - 1);
  within -= repeat * segment->amplitude;
  // Rounding may leave `within` at the very end of the repeat. The pulse is then the last that
  // sends light.
  auto pulse = std::upper_bound(segment->accumulated.begin(), segment->accumulated.end(), within);
  if (pulse == segment->accumulated.end()) {
    pulse = std::lower_bound(segment->accumulated.begin(), segment->accumulated.end(),
                             segment->amplitude);
  }
  const auto index = static_cast<std::size_t>(pulse - segment->accumulated.begin());
  return segment->begin_ps + repeat * segment->period_ps + segment->times_ps[index];
}

GeneratorClock::GeneratorClock(const Pattern& pattern, DriftRate drift)
    : period_ps_(pattern_period_ps(pattern)),
      calibration_(pattern.calibrated_period_ps.value_or(period_ps_) / period_ps_),
      drift_(drift) {
  set_rate();
}

void GeneratorClock::next_period() {
  start_.advance(period_ps_ * rate_);
  set_rate();
}

void GeneratorClock::back_periods(std::int64_t count) {
  start_.advance(-static_cast<double>(count) * period_ps_ * rate_);
  set_rate();
}

void GeneratorClock::set_rate() {
  double ppm = drift_.ppm;
  if (drift_.ramp_ppm_per_s != 0) {
    ppm += drift_.ramp_ppm_per_s * std::max(0.0, start_.seconds());
    ppm = std::clamp(ppm, -max_drift_ppm, max_drift_ppm);
  }
  rate_ = calibration_ * (1 + 1e-6 * ppm);
}

}  // namespace splid::simulator
