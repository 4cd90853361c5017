#pragma once

#include <cstddef>
#include <optional>

#include "config/config.hpp"
#include "protocol/truth.hpp"

namespace splid::tradeoff {

// What a detector sees of a target.
struct DwellLight {
  double signal_per_pulse = 0;  // of a pulse of amplitude 1
  double background_per_s = 0;
  double distance_m = 0;
  double velocity_mps = 0;
};

// The scene's first target at the scene's start.
DwellLight light_of(const SceneTruth& truth);

// The shortest dwell, ms, in which the bound of Cramer and Rao of the velocity is std_mps, to 0.1
// %; pooled: where `pixels` pixels of this light share their photons (scene.pool). Absent where a
// dwell of 60 s does not do, or there is no light.
//
// config: of one pixel; the pattern, the pulse, the detector and whether the target accelerates
// count. std_mps > 0, pixels > 0. Threads: any.
std::optional<double> dwell_ms(const Config& config, const DwellLight& light, double std_mps,
                               std::size_t pixels);

}  // namespace splid::tradeoff
