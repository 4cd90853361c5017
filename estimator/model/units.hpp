#pragma once

namespace splid {

// Constants that turn the units of protocol/ (ps) into those of the estimator (ns, m/s).
inline constexpr double speed_of_light_mps = 299'792'458.0;
inline constexpr double ns_per_ps = 1e-3;

}  // namespace splid
