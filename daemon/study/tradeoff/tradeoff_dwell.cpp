#include "daemon/study/tradeoff/tradeoff_dwell.hpp"

#include <cmath>

#include "daemon/study/tradeoff/tradeoff_score.hpp"
#include "estimator/likelihood/bound.hpp"
#include "estimator/model/units.hpp"

namespace splid::tradeoff {
namespace {

constexpr double longest_dwell_ms = 60'000;
constexpr double dwell_precision = 1.001;

}  // namespace

DwellLight light_of(const SceneTruth& truth) {
  return {truth.signal_per_pulse, truth.background_per_s, truth.distance_m.front(),
          truth.velocity_mps.front()};
}

std::optional<double> dwell_ms(const Config& config, const DwellLight& light, double std_mps,
                               std::size_t pixels) {
  if (!(light.signal_per_pulse > 0)) return std::nullopt;
  const auto share = static_cast<double>(pixels);
  const auto shape = pulse_shape(config);
  BoundScene scene;
  scene.delay_ns = 2e9 * light.distance_m / speed_of_light_mps;
  scene.velocity_mps = light.velocity_mps;
  scene.signal_per_pulse = share * light.signal_per_pulse;
  scene.background_per_ns = share * light.background_per_s * 1e-9;
  scene.accelerating = config.scene.motion == Motion::accelerating;
  scene.detector = {config.detector.dead_time_ns,
                    share * static_cast<double>(config.channels.photon.size())};
  const auto is_enough = [&](double length_ms) {
    scene.length_ns = scene.seen_ns = length_ms * 1e6;
    return cramer_rao_bound(config.pattern, *shape, scene).velocity_mps <= std_mps;
  };
  double most_ms = longest_dwell_ms;
  double least_ms = pattern_period_ps(config.pattern) * 1e-9;
  if (!is_enough(most_ms)) return std::nullopt;
  if (is_enough(least_ms)) return least_ms;
  while (most_ms > dwell_precision * least_ms) {
    const double mid_ms = std::sqrt(least_ms * most_ms);
    (is_enough(mid_ms) ? most_ms : least_ms) = mid_ms;
  }
  return most_ms;
}

}  // namespace splid::tradeoff
