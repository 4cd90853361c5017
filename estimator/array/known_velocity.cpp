#include "estimator/array/known_velocity.hpp"

#include <cmath>

#include "estimator/model/units.hpp"

namespace splid::array {

FrameView at_rest(const FrameView& frame, double velocity_mps) {
  const double stretch = 1 / (1 - walk_ns_at(velocity_mps, 1));
  FrameView still = frame;
  SyncFit& sync = still.sync;
  // From mid-frame to the pattern start nearest to it.
  double start_ps = static_cast<double>(sync.origin_ps - frame.mid_ps()) + sync.phase_ps;
  start_ps -= sync.period_ps * std::round(start_ps / sync.period_ps);
  sync.origin_ps = frame.mid_ps();
  sync.phase_ps = start_ps * stretch;
  sync.period_ps *= stretch;
  return still;
}

double pattern_delay_ns(const Estimate& estimate, const FrameView& frame, double period_ns,
                        ClockReference reference) {
  const double scale = frame.sync.period_ps * ns_per_ps / period_ns;
  const double to_pattern = reference == ClockReference::tagger ? scale : 1;
  return estimate.delay_ns / to_pattern / (1 + estimate.velocity_mps / speed_of_light_mps);
}

void set_moving(Estimate& estimate, const FrameView& frame, const Velocity& velocity,
                ClockReference reference) {
  // At rest the delay is D times the scale of the stretched clock, which is longer by 1 / (1 - g)
  // than the tagger's; it is to be D (1 + beta), with 1 - g = (1 - beta) / (1 + beta).
  const double beta = velocity.mps / speed_of_light_mps;
  const double to_moving = reference == ClockReference::tagger ? 1 - beta : 1 + beta;
  estimate.delay_ns *= to_moving;
  estimate.std_delay_ns *= to_moving;
  const double ppm = reference == ClockReference::tagger ? 0 : frame.sync.drift_ppm;
  const double length_ns =
      static_cast<double>(frame.end_ps - frame.start_ps) * ns_per_ps / (1 + 1e-6 * ppm);
  estimate.delay_start_ns = estimate.delay_ns - beta * length_ns;
  estimate.velocity_mps = velocity.mps;
  estimate.std_velocity_mps = velocity.std_mps;
}

}  // namespace splid::array
