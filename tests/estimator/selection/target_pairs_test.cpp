#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"
#include "tests/support/several_scene.hpp"

// All that a scene may have together: targets, dead time, a fitted width, motion, the pulse's
// shape.

namespace splid {
namespace {

using test::off_of;
using test::scene_of;

struct Combination {
  std::size_t targets = 2;
  double dead_time_ns = 0;
  PulseWidth width = PulseWidth::fixed;
  Motion motion = Motion::moving;
  Shape shape = Shape::gaussian;

  [[nodiscard]] std::string text() const {
    return std::to_string(targets) + " targets, dead for " + std::to_string(dead_time_ns) +
           " ns, width " + std::to_string(static_cast<int>(width)) + ", motion " +
           std::to_string(static_cast<int>(motion)) + ", shape " +
           std::to_string(static_cast<int>(shape));
  }
};

TabulatedPulse gaussian_table() {
  TabulatedPulse table;
  table.step_ps = 20;
  table.first_ps = -600;
  for (int n = -30; n <= 30; ++n) table.density.push_back(std::exp(-0.5 * n * n / 25.0));
  return table;
}

// Of the scene's targets, which are 30 widths and more apart.
std::vector<test::FrameMaker> targets_of(const Combination& of) {
  constexpr double off_ns[] = {0, 6.5, 40.3, -77.7}, apart_mps[] = {0, 15, -40, 4};
  const bool is_still = of.motion == Motion::static_target;
  std::vector<test::FrameMaker> all;
  for (std::size_t k = 0; k < of.targets; ++k) {
    const double signal = of.dead_time_ns > 0 ? 0.2 : 0.02;
    all.push_back(scene_of(off_ns[k], is_still ? 0 : 20 + apart_mps[k],
                           signal * (1 - 0.15 * static_cast<double>(k))));
    all.back().length_ms = 5;
    all.back().sigma_ns = of.width == PulseWidth::fitted ? 0.14 : 0.1;
    if (of.motion == Motion::accelerating) {
      all.back().acceleration_mps2 = 3e4 * (1 - 0.5 * static_cast<double>(k));
    }
    if (of.shape == Shape::tabulated) all.back().pattern.pulse = gaussian_table();
  }
  return all;
}

// A frame of all of them, seen by one detector.
test::FrameMaker::Frame frame_of(const std::vector<test::FrameMaker>& targets, double dead_time_ns,
                                 std::uint64_t seed) {
  const std::vector<test::FrameMaker> others(targets.begin() + 1, targets.end());
  auto frame = targets.front().make_with(others, seed);
  if (dead_time_ns == 0) return frame;
  test::FrameMaker detector = targets.front();
  detector.dead_time_ns = dead_time_ns;
  std::mt19937_64 random(seed);
  detector.blind(frame, random);
  return frame;
}

void expect_all_are_right(const Combination& of) {
  const std::vector<test::FrameMaker> truths = targets_of(of);
  PulseOptions pulse;
  pulse.width = of.width;
  pulse.shape = of.shape;
  SceneOptions scene;
  scene.targets = static_cast<std::int64_t>(of.targets);
  scene.motion = of.motion;
  scene.max_acceleration_mps2 = of.motion == Motion::accelerating ? 5e4 : 100;
  FrameEstimator estimator(truths.front().pattern, pulse, scene, {}, 5, 100'000,
                           ClockReference::tagger, {.dead_time_ns = of.dead_time_ns});
  constexpr int frames = 6;
  std::vector<double> squares(3);
  for (std::uint64_t seed = 0; seed < frames; ++seed) {
    const Estimate e = estimator.estimate(frame_of(truths, of.dead_time_ns, seed).view());
    ASSERT_EQ(e.status, FrameStatus::ok) << of.text();
    std::vector<TargetEstimate> found(e.targets.begin(), e.targets.begin() + e.target_count);
    if (found.empty()) found = {e.first_target()};
    ASSERT_EQ(found.size(), of.targets) << of.text() << ", frame " << seed;
    EXPECT_EQ(e.dead_time_modelled, of.dead_time_ns > 0);
    EXPECT_EQ(e.std_pulse_sigma_ns > 0, of.width == PulseWidth::fitted) << of.text();
    if (of.width == PulseWidth::fitted) {
      EXPECT_LT(std::abs(e.pulse_sigma_ns - 0.14), 5 * e.std_pulse_sigma_ns) << of.text();
    }
    EXPECT_EQ(e.std_acceleration_mps2 > 0, of.motion == Motion::accelerating) << of.text();
    for (const test::FrameMaker& truth : truths) {
      const TargetEstimate& own =
          *std::min_element(found.begin(), found.end(), [&](const auto& a, const auto& b) {
            return std::abs(off_of(a, truth)) < std::abs(off_of(b, truth));
          });
      const double off[] = {
          off_of(own, truth) / own.std_delay_ns,
          own.std_velocity_mps > 0 ? (own.velocity_mps - truth.velocity_mps) / own.std_velocity_mps
                                   : own.velocity_mps,
          (own.signal_per_pulse - truth.signal_per_pulse) / own.std_signal_per_pulse};
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_LT(std::abs(off[i]), 5) << of.text() << ", value " << i << ", frame " << seed;
        squares[i] += off[i] * off[i] / (frames * static_cast<double>(of.targets));
      }
    }
  }
  // Deviations are honest: of 6 values and more, a root mean square of 2 is chance in one of 1000.
  for (std::size_t i = 0; i < 3; ++i) EXPECT_LT(squares[i], 4) << of.text() << ", value " << i;
}

TEST(TargetPairs, OneToFourTargetsWithADeadTime) {
  for (const std::size_t targets : {1, 2, 3, 4}) {
    expect_all_are_right({.targets = targets, .dead_time_ns = 40});
  }
}

TEST(TargetPairs, OneToFourTargetsWithAFittedWidth) {
  for (const std::size_t targets : {1, 2, 3, 4}) {
    expect_all_are_right({.targets = targets, .width = PulseWidth::fitted});
  }
}

TEST(TargetPairs, AFittedWidthWithADeadTime) {
  for (const std::size_t targets : {1, 2}) {
    expect_all_are_right({.targets = targets, .dead_time_ns = 40, .width = PulseWidth::fitted});
  }
}

TEST(TargetPairs, TargetsAtRestWithDeadTimeAndWidth) {
  expect_all_are_right({.motion = Motion::static_target});
  expect_all_are_right({.dead_time_ns = 40, .motion = Motion::static_target});
  expect_all_are_right({.width = PulseWidth::fitted, .motion = Motion::static_target});
}

TEST(TargetPairs, TargetsThatAccelerateWithDeadTimeAndWidth) {
  expect_all_are_right({.motion = Motion::accelerating});
  expect_all_are_right({.dead_time_ns = 40, .motion = Motion::accelerating});
  expect_all_are_right({.targets = 1, .width = PulseWidth::fitted, .motion = Motion::accelerating});
  expect_all_are_right({.width = PulseWidth::fitted, .motion = Motion::accelerating});
}

// A window at rest, which is the brighter one, and a target that moves.
TEST(TargetPairs, AutomaticMotionLeavesEachItsOwn) {
  const test::FrameMaker window = scene_of(0, 0, 0.02), moving = scene_of(40, 25, 0.01);
  SceneOptions scene;
  scene.targets = 2;
  scene.motion = Motion::automatic;
  FrameEstimator estimator(window.pattern, {}, scene, {}, window.length_ms, 100'000);
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const Estimate e = estimator.estimate(window.make_with({moving}, seed).view());
    ASSERT_EQ(e.target_count, 2U) << seed;
    test::expect_is(e.targets[0], window);
    test::expect_is(e.targets[1], moving);
  }
}

TEST(TargetPairs, ATabulatedPulseWithDeadTimeAndWidth) {
  expect_all_are_right({.shape = Shape::tabulated});
  expect_all_are_right({.dead_time_ns = 40, .shape = Shape::tabulated});
  expect_all_are_right({.width = PulseWidth::fitted, .shape = Shape::tabulated});
}

}  // namespace
}  // namespace splid
