#include "drivers/simulator/emission.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace splid::simulator {

EmissionSchedule::EmissionSchedule(const Pattern& pattern) {
  double begin_ps = 0;
  for (const PatternSegment& segment : pattern.segments) {
    Stretch stretch{begin_ps, segment.period_ps, amplitude_, 0, 1, segment.pulse_times_ps, {}};
    // A single segment is looped, whatever its repeats.
    if (pattern.segments.size() > 1) stretch.repeats = static_cast<double>(segment.repeats);
    for (const double amplitude : segment.amplitudes) {
      stretch.amplitude += amplitude;
      stretch.accumulated.push_back(stretch.amplitude);
    }
    begin_ps += stretch.period_ps * stretch.repeats;
    amplitude_ += stretch.amplitude * stretch.repeats;
    if (stretch.amplitude > 0) stretches_.push_back(std::move(stretch));
  }
}

double EmissionSchedule::pulse_time_ps(double accumulated) const {
  auto stretch = std::upper_bound(
      stretches_.begin() + 1, stretches_.end(), accumulated,
      [](double value, const Stretch& candidate) { return value < candidate.begin_amplitude; });
  --stretch;
  double within = accumulated - stretch->begin_amplitude;
  const double repeat =
      std::clamp(std::floor(within / stretch->amplitude), 0.0, stretch->repeats - 1);
  within -= repeat * stretch->amplitude;
  // Rounding may leave `within` at the very end of the repeat. The pulse is then the last that
  // sends light.
  auto pulse = std::upper_bound(stretch->accumulated.begin(), stretch->accumulated.end(), within);
  if (pulse == stretch->accumulated.end()) {
    pulse = std::lower_bound(stretch->accumulated.begin(), stretch->accumulated.end(),
                             stretch->amplitude);
  }
  const auto index = static_cast<std::size_t>(pulse - stretch->accumulated.begin());
  return stretch->begin_ps + repeat * stretch->period_ps + stretch->times_ps[index];
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
