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

// How many times wider the deviations are than those of steady light as bright.
struct Wider {
  double signal, background;
};

Wider wider(const test::FrameMaker& made, std::uint64_t seed,
            const std::vector<Loss>& losses = {}) {
  test::FrameMaker steady = made;
  steady.signal_swing = steady.background_swing = 0;
  const Estimate found = estimate(made, seed, losses), beside = estimate(steady, seed, losses);
  EXPECT_TRUE(found.has_values && beside.has_values);
  return {found.std_signal_per_pulse / beside.std_signal_per_pulse,
          found.std_background_per_ns / beside.std_background_per_ns};
}

void expect_as_steady(const Wider& wide) {
  EXPECT_NEAR(wide.signal, 1, 0.1);
  EXPECT_NEAR(wide.background, 1, 0.1);
}

TEST(LightFlicker, ASignalThatVariesHasAWiderDeviation) {
  test::FrameMaker made = scene(0.5, 0.1);
  for (const double swing : {0.2, 0.5}) {
    made.signal_swing = swing;
    const Estimate found = estimate(made, 1);
    EXPECT_GT(found.signal_per_pulse, 0.5 - 2 * found.std_signal_per_pulse) << swing;
    EXPECT_GT(wider(made, 1).signal, 1.2) << swing;
  }
}

// The background's value is far from the truth, and its deviation says so. Distance, velocity and
// signal are right.
TEST(LightFlicker, ALampThatFlickersWidensTheBackgroundsDeviation) {
  test::FrameMaker made = scene(0.02, 1);
  made.background_swing = 0.5;
  made.swing_hz = 100;
  const Estimate found = estimate(made, 1);
  EXPECT_EQ(found.status, FrameStatus::ok);
  EXPECT_LT(found.background_per_ns, made.background_per_ns - found.std_background_per_ns / 2);
  EXPECT_GT(found.background_per_ns, made.background_per_ns - 2 * found.std_background_per_ns);
  EXPECT_GT(wider(made, 1).background, 5);
}

// Even deviations that are far too small stay as they are.
TEST(LightFlicker, SteadyLightKeepsItsDeviations) {
  for (const auto& [S, in_a_dead_time] :
       {std::pair{0.02, 0.01}, {0.1, 3.0}, {0.5, 0.1}, {3.0, 0.1}}) {
    const test::FrameMaker made = scene(S, in_a_dead_time);
    for (std::uint64_t seed = 0; seed < 2; ++seed) {
      Estimate found = estimate(made, seed);
      found.std_signal_per_pulse = found.std_background_per_ns = 1e-12;
      widen_by_flicker(made.make(seed).view(), PulseTrain(made.pattern), 1, found);
      EXPECT_EQ(found.std_signal_per_pulse, 1e-12) << S;
      EXPECT_EQ(found.std_background_per_ns, 1e-12) << S;
    }
  }
}

TEST(LightFlicker, NothingWidensWhereTheDeadTimeHardlyMatters) {
  test::FrameMaker made = scene(13.5e-4, 0.00875);
  made.signal_swing = 1;
  made.length_ms = 50;
  expect_as_steady(wider(made, 1));
}

TEST(LightFlicker, LeavesOutWhatALossTouches) {
  const std::vector<Loss> losses = {{3'000'000'000, 4'500'000'000, 1000},
                                    {7'000'000'000, 7'100'000'000, 100}};
  test::FrameMaker made = scene(0.5, 0.1);
  expect_as_steady({wider(made, 1, losses)});
  made.signal_swing = 0.5;
  EXPECT_GT(wider(made, 1, losses).signal, 1.2);
}

}  // namespace
}  // namespace splid
