#include "drivers/simulator/emission.hpp"

#include <gtest/gtest.h>

#include "tests/support/scene_runs.hpp"

namespace splid::simulator {
namespace {

using test::one_segment;

Pattern two_segments() {
  Pattern pattern;
  pattern.mode = Mode::mrr;
  pattern.segments = {{100, {0, 40}, {1, 0.5}, 3}, {70, {10}, {2}, 2}};
  return pattern;
}

TEST(EmissionSchedule, LightGoesToPulsesByAmplitude) {
  const EmissionSchedule schedule(one_segment(100, {0, 30, 60, 90}, {1, 0, 2, 0}));
  EXPECT_DOUBLE_EQ(schedule.amplitude(), 3);
  EXPECT_EQ(schedule.pulse_time_ps(0), 0);
  EXPECT_EQ(schedule.pulse_time_ps(0.999), 0);
  EXPECT_EQ(schedule.pulse_time_ps(1), 60);
  EXPECT_EQ(schedule.pulse_time_ps(2.999), 60);
  EXPECT_EQ(schedule.pulse_time_ps(3), 60);  // rounding may ask for the very end
}

TEST(EmissionSchedule, SegmentsRunInTurn) {
  const EmissionSchedule schedule(two_segments());
  EXPECT_DOUBLE_EQ(schedule.amplitude(), 8.5);
  EXPECT_EQ(schedule.pulse_time_ps(0.5), 0);
  EXPECT_EQ(schedule.pulse_time_ps(1.2), 40);
  EXPECT_EQ(schedule.pulse_time_ps(1.6), 100);
  EXPECT_EQ(schedule.pulse_time_ps(4.4), 240);
  EXPECT_EQ(schedule.pulse_time_ps(4.6), 310);
  EXPECT_EQ(schedule.pulse_time_ps(6.6), 380);
}

TEST(EmissionSchedule, SegmentsWithoutLightAreSkipped) {
  Pattern pattern = two_segments();
  pattern.segments[0].amplitudes = {0, 0};
  const EmissionSchedule schedule(pattern);
  EXPECT_DOUBLE_EQ(schedule.amplitude(), 4);
  EXPECT_EQ(schedule.pulse_time_ps(0), 310);
}

TEST(GeneratorClock, PeriodIsLongerByTheDrift) {
  GeneratorClock clock(one_segment(1e6, {0}, {1}), {100, 0});
  for (int i = 0; i < 1000; ++i) clock.next_period();
  EXPECT_EQ(clock.period_start().rounded_ps(), 1'000'100'000);
  EXPECT_NEAR(clock.at(0.5e6).fraction_ps + static_cast<double>(clock.at(0.5e6).ps), 1'000'600'050,
              1e-3);
}

TEST(GeneratorClock, RampAddsUpQuadratically) {
  GeneratorClock clock(one_segment(1e9, {0}, {1}), {0, 10});
  for (int i = 0; i < 2000; ++i) clock.next_period();
  // 2 s at 10 ppm/s: half of 10e-6 times 4 s^2 late, to within a period's worth.
  EXPECT_NEAR(clock.period_start().seconds() - 2, 20e-6, 2e-8);
}

TEST(GeneratorClock, RampEndsAtTheLargestDrift) {
  GeneratorClock clock(one_segment(1e12, {0}, {1}), {0, -100});
  for (int i = 0; i < 50; ++i) clock.next_period();
  EXPECT_NEAR(clock.period_ps(), 1e12 * (1 - 1e-6 * max_drift_ppm), 1);
}

TEST(GeneratorClock, CalibratedPatternsRunAtTheirCalibratedPeriod) {
  Pattern pattern = one_segment(1e6, {0}, {1});
  pattern.calibrated_period_ps = 1'000'003;
  GeneratorClock clock(pattern, {0, 0});
  EXPECT_DOUBLE_EQ(clock.period_ps(), 1'000'003);
  EXPECT_NEAR(static_cast<double>(clock.at(5e5).ps) + clock.at(5e5).fraction_ps, 500'001.5, 1e-6);
}

TEST(GeneratorClock, GoesBackBeforeTheStart) {
  GeneratorClock clock(one_segment(1e6, {0}, {1}), {10, 5});
  clock.back_periods(4);
  EXPECT_EQ(clock.period_start().rounded_ps(), -4'000'040);
  for (int i = 0; i < 4; ++i) clock.next_period();
  EXPECT_EQ(clock.period_start().rounded_ps(), 0);
}

}  // namespace
}  // namespace splid::simulator
