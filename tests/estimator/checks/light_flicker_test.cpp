#include "estimator/checks/light_flicker.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

test::FrameMaker scene(double S, double in_a_dead_time) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.length_ms = 20;
  made.dead_time_ns = 50;
  made.signal_per_pulse = S;
  made.background_per_ns = in_a_dead_time / made.dead_time_ns;
  return made;
}

Estimate estimate(const test::FrameMaker& made, std::uint64_t seed,
                  const std::vector<Loss>& losses = {}) {
  test::FrameMaker::Frame frame = made.make(seed);
  for (const Loss& loss : losses) {
    std::erase_if(frame.photons_ps,
                  [&](std::int64_t t) { return t >= loss.begin_ps && t < loss.end_ps; });
  }
  frame.losses = losses;
  FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, frame.photons_ps.size(),
                           ClockReference::tagger, {made.dead_time_ns, DeadTime::modelled},
                           static_cast<std::size_t>(made.inputs));
  return estimator.estimate(frame.view());
}

TEST(LightFlicker, SaysByHowMuchTheTargetsLightVaries) {
  test::FrameMaker made = scene(0.5, 0.1);
  for (const double swing : {0.2, 0.5}) {
    made.signal_swing = swing;
    const Estimate found = estimate(made, 1);
    EXPECT_LT(found.signal_per_pulse, 0.5 - found.std_signal_per_pulse / 2) << swing;
    EXPECT_NEAR(found.flicker_misfit.value_or(0), swing / std::sqrt(2), swing / 7) << swing;
  }
}

// So much would be more than a target's light varies by.
TEST(LightFlicker, SaysByHowMuchALampFlickers) {
  test::FrameMaker made = scene(0.02, 1);
  made.background_swing = 0.5;
  made.swing_hz = 100;
  const Estimate found = estimate(made, 1);
  EXPECT_LT(found.background_per_ns, made.background_per_ns - 5 * found.std_background_per_ns);
  EXPECT_NEAR(found.flicker_misfit.value_or(0), 0.5 / std::sqrt(2), 0.07);
}

TEST(LightFlicker, SaysNothingOfSteadyLight) {
  for (const auto& [S, in_a_dead_time] :
       {std::pair{0.02, 0.01}, {0.1, 3.0}, {0.5, 0.1}, {3.0, 0.1}, {3.0, 3.0}}) {
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
      EXPECT_EQ(estimate(scene(S, in_a_dead_time), seed).flicker_misfit, std::nullopt)
          << S << " " << in_a_dead_time;
    }
  }
}

// Afterpulses come in bursts, and detectors that share the light hide less of it.
TEST(LightFlicker, SaysNothingOfAfterpulsesAndOfSeveralInputs) {
  test::FrameMaker made = scene(0.5, 0.1);
  made.afterpulse_probability = 0.05;
  EXPECT_EQ(estimate(made, 1).flicker_misfit, std::nullopt);
  made = scene(3, 0.1);
  made.inputs = 2;
  EXPECT_EQ(estimate(made, 1).flicker_misfit, std::nullopt);
}

TEST(LightFlicker, SaysNothingWhereTheDeadTimeHardlyMatters) {
  test::FrameMaker made = scene(13.5e-4, 0.00875);
  made.signal_swing = 1;
  made.length_ms = 50;
  const Estimate found = estimate(made, 1);
  ASSERT_TRUE(found.has_values);
  EXPECT_EQ(found.flicker_misfit, std::nullopt);
}

TEST(LightFlicker, LeavesOutWhatALossTouches) {
  const std::vector<Loss> losses = {{3'000'000'000, 4'500'000'000, 1000},
                                    {7'000'000'000, 7'100'000'000, 100}};
  test::FrameMaker made = scene(0.5, 0.1);
  ASSERT_TRUE(estimate(made, 1, losses).has_values);
  EXPECT_EQ(estimate(made, 1, losses).flicker_misfit, std::nullopt);
  made.signal_swing = 0.5;
  EXPECT_NEAR(estimate(made, 1, losses).flicker_misfit.value_or(0), 0.35, 0.07);
}

}  // namespace
}  // namespace splid
