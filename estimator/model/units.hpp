#pragma once

#include <cmath>

namespace splid {

// Constants that turn the units of protocol/ (ps) into those of the estimator (ns, m/s) and of
// frames (ms).
inline constexpr double speed_of_light_mps = 299'792'458.0;
inline constexpr double ns_per_ps = 1e-3;
inline constexpr double ps_per_ms = 1e9;

// value modulo period, in [0, period).
inline double fold_on(double value, double period) {
  const double rest = value - period * std::floor(value / period);
  return rest < period ? rest : 0.0;
}

// g t_a: how far the delay walks over a frame of this length, for a target at this speed.
constexpr double walk_ns_at(double velocity_mps, double length_ns) {
  const double beta = velocity_mps / speed_of_light_mps;
  return 2 * beta / (1 + beta) * length_ns;
}

// The acceleration of a path with this quadratic term, a t_a^2 / (6 c), over a frame of this
// length; see DelayTrack.
constexpr double acceleration_of(double quadratic_ns, double length_ns) {
  return 6 * quadratic_ns * speed_of_light_mps * 1e9 / (length_ns * length_ns);
}

}  // namespace splid
