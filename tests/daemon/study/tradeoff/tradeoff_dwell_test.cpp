#include "daemon/study/tradeoff/tradeoff_dwell.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "daemon/study/tradeoff/tradeoff_score.hpp"
#include "estimator/likelihood/bound.hpp"
#include "tests/support/daemon_scene.hpp"

namespace splid::tradeoff {
namespace {

constexpr DwellLight some_light{0.01, 10'000, 20, 1};

TEST(TradeoffDwell, TheBoundOfTheDwellIsTheWantedDeviation) {
  const Config config = scene_config(1);
  const auto dwell = dwell_ms(config, some_light, 0.1, 1);
  ASSERT_TRUE(dwell);
  BoundScene scene;
  scene.length_ns = scene.seen_ns = *dwell * 1e6;
  scene.delay_ns = 2 * 20 / 0.299792458;
  scene.velocity_mps = 1;
  scene.signal_per_pulse = 0.01;
  scene.background_per_ns = 1e-5;
  const auto shape = pulse_shape(config);
  EXPECT_NEAR(cramer_rao_bound(config.pattern, *shape, scene).velocity_mps, 0.1, 3e-4);
}

TEST(TradeoffDwell, ADwellOfNinePixelsIsShorterByTheirPhotons) {
  const Config config = scene_config(1);
  const double one = dwell_ms(config, some_light, 0.1, 1).value();
  const double pooled = dwell_ms(config, some_light, 0.1, 9).value();
  // The deviation falls with the root of the photons and, beside, with the length.
  EXPECT_NEAR(one / pooled, std::cbrt(9), 0.02);
}

TEST(TradeoffDwell, SomeDeviationsTakeNoDwell) {
  const Config config = scene_config(1);
  EXPECT_EQ(dwell_ms(config, some_light, 1e-12, 1), std::nullopt);
  EXPECT_EQ(dwell_ms(config, {0, 1000, 20, 1}, 0.1, 1), std::nullopt) << "no light comes back";
}

}  // namespace
}  // namespace splid::tradeoff
