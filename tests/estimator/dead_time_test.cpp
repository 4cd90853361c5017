#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "estimator/frame_estimator.hpp"
#include "estimator/model/units.hpp"
#include "tests/support/frame_maker.hpp"

// The estimates of frames whose detector was dead after each detection.

namespace splid {
namespace {

test::FrameMaker paper_light() {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  return made;
}

double delay_off_ns(const Estimate& estimate, const test::FrameMaker& made) {
  const double period_ns = made.pattern.segments.front().period_ps * 1e-3;
  return std::remainder(estimate.delay_ns - 2 * made.distance_m / (speed_of_light_mps * 1e-9),
                        period_ns);
}

// Light in which half of all photons come in the dead time.
test::FrameMaker bright_scene() {
  test::FrameMaker made = paper_light();
  made.length_ms = 1;
  made.velocity_mps = 20;
  made.signal_per_pulse = 1;
  made.background_per_ns = 0.006;
  made.dead_time_ns = 50;
  return made;
}

FrameEstimator estimator_with(const test::FrameMaker& made, DetectorOptions detector,
                              const SceneOptions& scene = {}) {
  return {made.pattern,
          {},
          scene,
          {},
          made.length_ms,
          400'000,
          ClockReference::tagger,
          detector,
          static_cast<std::size_t>(made.inputs)};
}

void expect_same_bits(const Estimate& a, const Estimate& b) {
  EXPECT_EQ(a.status, b.status);
  const auto bits = [](double value) { return std::bit_cast<std::uint64_t>(value); };
  EXPECT_EQ(bits(a.delay_ns), bits(b.delay_ns));
  EXPECT_EQ(bits(a.velocity_mps), bits(b.velocity_mps));
  EXPECT_EQ(bits(a.signal_per_pulse), bits(b.signal_per_pulse));
  EXPECT_EQ(bits(a.background_per_ns), bits(b.background_per_ns));
  EXPECT_EQ(bits(a.std_delay_ns), bits(b.std_delay_ns));
  EXPECT_EQ(bits(a.significance_nats), bits(b.significance_nats));
}

// The mean of 50 errors in units of their deviations is 0 within 0.57 (4 sigma).
void expect_unbiased(const test::FrameMaker& made, const SceneOptions& scene = {}) {
  constexpr int frames = 50;
  const DetectorOptions known = {made.dead_time_ns};
  FrameEstimator modelled = estimator_with(made, known, scene);
  FrameEstimator flagged = estimator_with(made, {made.dead_time_ns, DeadTime::flagged}, scene);
  double delay = 0, signal = 0, background = 0, acceleration = 0, signal_flagged = 0;
  for (int n = 0; n < frames; ++n) {
    const auto frame = made.make(static_cast<std::uint64_t>(n));
    const Estimate e = modelled.estimate(frame.view());
    ASSERT_EQ(e.status, FrameStatus::ok);
    EXPECT_TRUE(e.dead_time_modelled);
    delay += delay_off_ns(e, made) / e.std_delay_ns / frames;
    signal += (e.signal_per_pulse - made.signal_per_pulse) / e.std_signal_per_pulse / frames;
    background += (e.background_per_ns - made.background_per_ns) / e.std_background_per_ns / frames;
    if (made.acceleration_mps2 != 0) {
      ASSERT_GT(e.std_acceleration_mps2, 0);
      acceleration +=
          (e.acceleration_mps2 - made.acceleration_mps2) / e.std_acceleration_mps2 / frames;
    }
    const Estimate f = flagged.estimate(frame.view());
    EXPECT_FALSE(f.dead_time_modelled);
    signal_flagged +=
        (f.signal_per_pulse - made.signal_per_pulse) / f.std_signal_per_pulse / frames;
  }
  EXPECT_NEAR(delay, 0, 0.57);
  EXPECT_NEAR(signal, 0, 0.57);
  EXPECT_NEAR(background, 0, 0.57);
  EXPECT_NEAR(acceleration, 0, 0.57);
  EXPECT_LT(signal_flagged, -10);
}

TEST(DeadTime, ADeadTimeThatIsModelledBiasesNothing) {
  expect_unbiased(bright_scene());
  test::FrameMaker split = bright_scene();
  split.inputs = 2;
  expect_unbiased(split);
  test::FrameMaker rates = bright_scene();
  rates.pattern = test::mrr_pattern({180000, 189000}, 3780000, 2e8);
  expect_unbiased(rates);
}

// Taken as even, 80 : 20 makes the signal 4 deviations low.
TEST(DeadTime, LightThatIsSplitUnevenlyBiasesNothing) {
  test::FrameMaker split = bright_scene();
  split.signal_per_pulse = 0.5;
  split.inputs = 2;
  split.first_share = 0.8;
  expect_unbiased(split);
  split.inputs = 4;
  expect_unbiased(split);
}

TEST(DeadTime, WithoutTheCountsOfEachInputTheSplitIsTakenAsEven) {
  test::FrameMaker made = bright_scene();
  made.inputs = 2;
  made.first_share = 0.8;
  const auto frame = made.make(3);
  FrameEstimator estimator = estimator_with(made, {made.dead_time_ns});
  FrameView view = frame.view();
  view.photons_of_input = {};
  const Estimate unknown = estimator.estimate(view);
  const Estimate known = estimator.estimate(frame.view());
  EXPECT_GT(known.signal_per_pulse, unknown.signal_per_pulse + unknown.std_signal_per_pulse);
  EXPECT_GT(known.blind_fraction, 1.1 * unknown.blind_fraction);
  const std::uint64_t half = frame.photons_ps.size() / 2;
  const std::vector<std::uint64_t> even = {half, half};
  view.photons_of_input = even;
  const Estimate counted = estimator.estimate(view);
  expect_same_bits(counted, unknown);
  // Counts of a single input say nothing.
  made.inputs = 1;
  FrameEstimator single = estimator_with(made, {made.dead_time_ns});
  auto of_one = made.make(3);
  const Estimate alone = single.estimate(of_one.view());
  of_one.photons_of_input = {of_one.photons_ps.size()};
  expect_same_bits(single.estimate(of_one.view()), alone);
}

// The path curves by 13 pulse widths.
TEST(DeadTime, ADeadTimeIsModelledOnCurvedPaths) {
  test::FrameMaker made = bright_scene();
  made.acceleration_mps2 = 4e5;
  for (const Motion motion : {Motion::accelerating, Motion::automatic}) {
    expect_unbiased(made, {.motion = motion, .max_acceleration_mps2 = 5e5});
  }
  made.signal_per_pulse = 0.5;
  made.inputs = 2;
  made.first_share = 0.8;
  expect_unbiased(made, {.motion = Motion::accelerating, .max_acceleration_mps2 = 5e5});
}

// 300,000 photons: the search works on a sample, and photons near the pulses are gathered.
TEST(DeadTime, ADeadTimeIsModelledInFramesOfVeryManyPhotons) {
  test::FrameMaker made = bright_scene();
  made.length_ms = 50;
  made.signal_per_pulse = 0.6;
  FrameEstimator estimator = estimator_with(made, {made.dead_time_ns});
  const auto frame = made.make(5);
  EXPECT_GT(frame.photons_ps.size(), 250'000U);
  const Estimate e = estimator.estimate(frame.view());
  ASSERT_EQ(e.status, FrameStatus::ok);
  EXPECT_LT(std::abs(delay_off_ns(e, made)), 4 * e.std_delay_ns);
  EXPECT_NEAR(e.velocity_mps, made.velocity_mps, 4 * e.std_velocity_mps);
  EXPECT_NEAR(e.signal_per_pulse, made.signal_per_pulse, 4 * e.std_signal_per_pulse);
  EXPECT_NEAR(e.background_per_ns, made.background_per_ns, 4 * e.std_background_per_ns);
}

TEST(DeadTime, ADeadTimeTooShortToMatterMovesNothing) {
  const test::FrameMaker made = paper_light();
  const auto frame = made.make(3);
  FrameEstimator ideal = estimator_with(made, {});
  FrameEstimator brief = estimator_with(made, {0.5});
  const Estimate e = brief.estimate(frame.view()), i = ideal.estimate(frame.view());
  EXPECT_EQ(e.status, i.status);
  EXPECT_NEAR(e.delay_ns, i.delay_ns, 0.05 * i.std_delay_ns);
  EXPECT_NEAR(e.velocity_mps, i.velocity_mps, 0.05 * i.std_velocity_mps);
  EXPECT_NEAR(e.signal_per_pulse, i.signal_per_pulse, 0.05 * i.std_signal_per_pulse);
  EXPECT_NEAR(e.background_per_ns, i.background_per_ns, 0.05 * i.std_background_per_ns);
  EXPECT_TRUE(e.dead_time_modelled);
  EXPECT_NEAR(e.blind_fraction, 0.5 * static_cast<double>(frame.photons_ps.size()) / 5e7, 1e-6);
}

// A dead time is short in this light, but each pulse hides most of itself.
void expect_unbiased_signal(const test::FrameMaker& made, const SceneOptions& scene = {}) {
  FrameEstimator estimator = estimator_with(made, {made.dead_time_ns}, scene);
  double signal = 0;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const Estimate e = estimator.estimate(made.make(seed).view());
    signal += (e.signal_per_pulse - made.signal_per_pulse) / e.std_signal_per_pulse / 50;
  }
  EXPECT_NEAR(signal, 0, 0.57);
}

TEST(DeadTime, BrightPulsesAloneAskForTheDeadTime) {
  test::FrameMaker made = bright_scene();
  made.pattern = test::periodic_pattern(3780000);
  made.background_per_ns = 1e-5;
  made.dead_time_ns = 2;
  expect_unbiased_signal(made);
  made.acceleration_mps2 = 4e5;
  for (const Motion motion : {Motion::accelerating, Motion::automatic}) {
    expect_unbiased_signal(made, {.motion = motion, .max_acceleration_mps2 = 5e5});
  }
}

TEST(DeadTime, DetectionsThatContradictTheDeadTimeAreNotModelled) {
  const test::FrameMaker made = bright_scene();
  const auto frame = made.make(3);
  FrameEstimator wrong = estimator_with(made, {60});
  FrameEstimator ideal = estimator_with(made, {});
  const Estimate e = wrong.estimate(frame.view());
  EXPECT_FALSE(e.dead_time_modelled);
  expect_same_bits(e, ideal.estimate(frame.view()));
}

TEST(DeadTime, TheOrderOfPhotonsMakesNoDifferenceToTheDeadTime) {
  const test::FrameMaker made = bright_scene();
  auto frame = made.make(3);
  FrameEstimator estimator = estimator_with(made, {made.dead_time_ns});
  const Estimate e = estimator.estimate(frame.view());
  for (std::size_t i = 0; i + 1 < frame.photons_ps.size(); i += 7) {
    std::swap(frame.photons_ps[i], frame.photons_ps[i + 1]);
  }
  const Estimate swapped = estimator.estimate(frame.view());
  EXPECT_NEAR(swapped.delay_ns, e.delay_ns, 1e-9);
  EXPECT_NEAR(swapped.signal_per_pulse, e.signal_per_pulse, 1e-9);
  EXPECT_EQ(swapped.blind_fraction, e.blind_fraction);
}

}  // namespace
}  // namespace splid
