#pragma once

namespace splid {

// Constants that turn the units of protocol/ (ps) into those of the estimator (ns, m/s) and of
// frames (ms).
inline constexpr double speed_of_light_mps = 299'792'458.0;
inline constexpr double ns_per_ps = 1e-3;
inline constexpr double ps_per_ms = 1e9;

// g t_a: how far the delay walks over a frame of this length, for a target at this speed.
constexpr double walk_ns_at(double velocity_mps, double length_ns) {
  const double beta = velocity_mps / speed_of_light_mps;
  return 2 * beta / (1 + beta) * length_ns;
}

// A path that bends by b over a frame has b (s^2 - 1/12) at the share s from -1/2 to 1/2, which is
// b/6 times the Legendre polynomial P_2 of 2 s.
inline constexpr double bend_per_quadratic = 6;

// The acceleration of a path that bends by a t_a^2 / c over a frame of this length.
constexpr double acceleration_of_bend(double bend_ns, double length_ns) {
  return bend_ns * speed_of_light_mps * 1e9 / (length_ns * length_ns);
}

}  // namespace splid
