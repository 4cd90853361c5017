#include "estimator/paper/emission_times.hpp"

#include <algorithm>
#include <cmath>

namespace splid::paper {

EmissionTimes::Cursor EmissionTimes::first_from(double time_ns) const {
  Cursor at = {std::floor(time_ns / train_.period_ns), 0, 0, 0};
  const double phase_ns = time_ns - at.turn * train_.period_ns;
  at.segment = train_.segment_at(phase_ns);
  const PulseTrain::Segment& own = train_.segments[at.segment];
  const double within_ns = phase_ns - own.begin_ns;
  const double period_ns = own.comb.period_ns;
  const double last_repeat = std::round((own.end_ns - own.begin_ns) / period_ns) - 1;
  at.repeat = std::clamp(std::floor(within_ns / period_ns), 0.0, last_repeat);
  const std::vector<double>& times_ns = own.comb.times_ns;
  const auto next =
      std::lower_bound(times_ns.begin(), times_ns.end(), within_ns - at.repeat * period_ns);
  at.pulse = static_cast<std::size_t>(next - times_ns.begin());
  if (at.pulse == times_ns.size()) {
    --at.pulse;
    step(at);
  }
  return at;
}

void EmissionTimes::step(Cursor& at) const {
  const PulseTrain::Segment& own = train_.segments[at.segment];
  if (++at.pulse < own.comb.times_ns.size()) return;
  at.pulse = 0;
  at.repeat += 1;
  const double period_ns = own.comb.period_ns;
  if (at.repeat * period_ns < own.end_ns - own.begin_ns - period_ns / 2) return;
  at.repeat = 0;
  if (++at.segment < train_.segments.size()) return;
  at.segment = 0;
  at.turn += 1;
}

}  // namespace splid::paper
