#include "drivers/simulator/echo.hpp"

#include <cmath>

namespace splid::simulator {

// Design note: the unknown is the time of flight, not the time of the meeting, so that the answer
// keeps all its digits after months. Newton's step is exact for a constant velocity; a corner in
// the path still leaves a contraction by v/c <= 1e-4 a step: eight steps are always enough, and
// what is left after a change of 0.01 ps is 1e-6 ps.
std::optional<double> round_trip_ps(const TargetPath& motion, const FineTime& emitted) {
  const double emitted_s = emitted.seconds();
  const double light_m = light_m_per_ps / motion.clock_rate();  // in a ps of the tagger's clock
  MotionState target = motion.at(emitted_s);
  if (!(target.distance_m > 0)) return std::nullopt;
  double flight_ps = target.distance_m / light_m;
  for (int step = 0; step < 8; ++step) {
    target = motion.at(emitted_s + flight_ps / ps_per_s);
    const double ahead_m = target.distance_m - light_m * flight_ps;
    const double change_ps =
        ahead_m / (light_m - target.velocity_mps / motion.clock_rate() / ps_per_s);
    flight_ps += change_ps;
    if (std::abs(change_ps) < 1e-2) break;
  }
  if (!(flight_ps > 0)) return std::nullopt;
  return 2 * flight_ps;
}

}  // namespace splid::simulator
