#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "estimator/frame_estimator.hpp"
#include "tests/support/several_scene.hpp"

namespace splid {
namespace {

using test::expect_is;
using test::off_of;
using test::scene_of;
using test::several;

// Two lines that cross leave little over beside them, but much at the comb's side lobes.
TEST(CrossingTargets, CrossingLinesHaveNoSideLobes) {
  const test::FrameMaker first = scene_of(0, 20, 33e-4), second = scene_of(0, 25, 33e-4);
  FrameEstimator estimator = several(first, 2);
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const Estimate e = estimator.estimate(first.make_with({second}, seed).view());
    for (std::size_t k = 0; k < e.target_count; ++k) {
      EXPECT_LT(std::abs(off_of(e.targets.at(k), first)), 0.5) << seed;
    }
  }
}

// Lines that cross are told apart where they are so close that others are not.
TEST(CrossingTargets, ThatCrossAreToldApart) {
  const test::FrameMaker first = scene_of(0, 20, 40e-4);
  const test::FrameMaker scenes[] = {scene_of(0, 26, 40e-4), scene_of(0.05, 14, 30e-4)};
  for (const std::int64_t targets : {2, 4}) {
    FrameEstimator estimator = several(first, targets);
    for (const test::FrameMaker& second : scenes) {
      double squares = 0;
      int resolved = 0;
      for (std::uint64_t seed = 0; seed < 30; ++seed) {
        const Estimate e = estimator.estimate(first.make_with({second}, seed).view());
        if (e.target_count != 2) continue;
        ++resolved;
        const bool in_order = (e.targets[0].velocity_mps > e.targets[1].velocity_mps) ==
                              (first.velocity_mps > second.velocity_mps);
        const TargetEstimate& own = e.targets[in_order ? 0 : 1];
        expect_is(own, first);
        expect_is(e.targets[in_order ? 1 : 0], second);
        EXPECT_LT(own.std_velocity_mps, 0.5);  // they part by 6 m/s
        squares += std::pow((own.velocity_mps - 20) / own.std_velocity_mps, 2);
      }
      EXPECT_GE(resolved, 29);
      EXPECT_NEAR(squares / resolved, 1, 4 * std::sqrt(2.0 / 30));
    }
  }
}

// Where the delays of two differ by a multiple of one rate's period, half of each one's light is on
// the other's place, and parts from it there.
TEST(CrossingTargets, HalfOfAnotherCombIsNotWhatCrosses) {
  const test::FrameMaker first = scene_of(0, 20, 40e-4);
  const test::FrameMaker scenes[] = {scene_of(360, 22.8, 40e-4), scene_of(-180, 16.5, 25e-4),
                                     scene_of(189.02, 24, 20e-4), scene_of(180, 17.9, 38e-4)};
  for (const std::int64_t targets : {2, 3}) {
    FrameEstimator estimator = several(first, targets);
    for (const test::FrameMaker& second : scenes) {
      int resolved = 0;
      for (std::uint64_t seed = 0; seed < 30; ++seed) {
        const Estimate e = estimator.estimate(first.make_with({second}, seed).view());
        const auto found = std::span(e.targets).first(e.target_count);
        if (std::any_of(found.begin(), found.end(),
                        [](const auto& target) { return target.status != FrameStatus::ok; })) {
          continue;
        }
        resolved += found.size() == 2 ? 1 : 0;
        for (const TargetEstimate& target : found) {
          const bool is_first = std::abs(target.velocity_mps - 20) <
                                std::abs(target.velocity_mps - second.velocity_mps);
          expect_is(target, is_first ? first : second);
        }
      }
      EXPECT_GE(resolved, 20);
    }
  }
}

// Its light is spread over more than a pulse at both ends of the frame and in its middle.
TEST(CrossingTargets, ACurvedPathIsOneTarget) {
  SceneOptions scene;
  scene.motion = Motion::moving;
  test::FrameMaker made = scene_of(0, 20, 40e-4);
  FrameEstimator estimator = several(made, 2, scene);
  for (const double acceleration_mps2 : {300.0, 500.0, 800.0}) {
    made.acceleration_mps2 = acceleration_mps2;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      const Estimate e = estimator.estimate(made.make(seed).view());
      EXPECT_EQ(e.target_count, 0U) << acceleration_mps2;
    }
  }
}

// A weak one that moves away from a bright one, or through it, is no tail: no tail moves. Its range
// may be in doubt, where half of its light is at a side lobe of its comb.
TEST(CrossingTargets, AWeakOneThatMovesOtherwiseIsFound) {
  struct {
    double delay_ns, apart_mps;
  } const places[] = {{0.5, 2}, {0.4, 2.5}, {0.3, 2}, {-0.5, 2}, {0, 3.1}};
  test::FrameMaker bright = scene_of(0, 20, 54e-4);
  bright.length_ms = 50;
  FrameEstimator estimator = several(bright, 2);
  for (const auto& [delay_ns, apart_mps] : places) {
    test::FrameMaker weak = scene_of(delay_ns, 20 + apart_mps, 2.7e-4);
    weak.length_ms = bright.length_ms;
    int found = 0;
    for (std::uint64_t seed = 200; seed < 240; ++seed) {
      const Estimate e = estimator.estimate(bright.make_with({weak}, seed).view());
      if (e.target_count != 2) continue;
      expect_is(e.targets[0], bright);
      const TargetEstimate& second = e.targets[1];
      EXPECT_LT(std::abs(off_of(second, weak)), 5 * second.std_delay_ns);
      EXPECT_NEAR(second.velocity_mps, weak.velocity_mps, 5 * second.std_velocity_mps);
      ++found;
    }
    EXPECT_GE(found, 39) << delay_ns << " ns, " << apart_mps << " m/s";
  }
}

}  // namespace
}  // namespace splid
