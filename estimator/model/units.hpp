#pragma once

namespace splid {

inline constexpr double speed_of_light_mps = 299'792'458.0;
inline constexpr double ns_per_ps = 1e-3;

}  // namespace splid
