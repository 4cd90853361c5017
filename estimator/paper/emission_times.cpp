#include "estimator/paper/emission_times.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "estimator/model/units.hpp"

namespace splid::paper {

EmissionTimes::EmissionTimes(const Pattern& pattern)
    : period_ns_(pattern_period_ps(pattern) * ns_per_ps) {
  double begin_ns = 0;
  for (const PatternSegment& segment : pattern.segments) {
    // A single segment is played for ever, whatever its repeats say, so that the pattern is one of
    // its periods.
    const std::int64_t repeats = pattern.segments.size() == 1 ? 1 : segment.repeats;
    Train train;
    train.begin_ns = begin_ns;
    train.period_ns = segment.period_ps * ns_per_ps;
    train.length_ns = train.period_ns * static_cast<double>(repeats);
    for (std::size_t p = 0; p < segment.pulse_times_ps.size(); ++p) {
      if (segment.amplitudes[p] <= 0) continue;
      train.times_ns.push_back(segment.pulse_times_ps[p] * ns_per_ps);
      train.amplitudes.push_back(segment.amplitudes[p]);
      train.amplitude += segment.amplitudes[p];
    }
    begin_ns += train.length_ns;
    amplitude_ += train.amplitude * static_cast<double>(repeats);
    trains_.push_back(std::move(train));
  }
}

EmissionTimes::Cursor EmissionTimes::first_from(double time_ns) const {
  Cursor at = {std::floor(time_ns / period_ns_), 0, 0, 0};
  const double phase_ns = time_ns - at.turn * period_ns_;
  while (at.train + 1 < trains_.size() && phase_ns >= trains_[at.train + 1].begin_ns) ++at.train;
  const Train& train = trains_[at.train];
  const double within_ns = phase_ns - train.begin_ns;
  const double last_repeat = std::round(train.length_ns / train.period_ns) - 1;
  at.repeat = std::clamp(std::floor(within_ns / train.period_ns), 0.0, last_repeat);
  const auto next = std::lower_bound(train.times_ns.begin(), train.times_ns.end(),
                                     within_ns - at.repeat * train.period_ns);
  at.pulse = static_cast<std::size_t>(next - train.times_ns.begin());
  if (at.pulse == train.times_ns.size()) {
    --at.pulse;
    step(at);
  }
  return at;
}

void EmissionTimes::step(Cursor& at) const {
  if (++at.pulse < trains_[at.train].times_ns.size()) return;
  at.pulse = 0;
  at.repeat += 1;
  const Train& train = trains_[at.train];
  if (at.repeat * train.period_ns < train.length_ns - train.period_ns / 2) return;
  at.repeat = 0;
  if (++at.train < trains_.size()) return;
  at.train = 0;
  at.turn += 1;
}

}  // namespace splid::paper
