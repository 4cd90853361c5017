#include "estimator/selection/target_selection.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <span>

#include "estimator/frame_estimator.hpp"
#include "protocol/error.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/frame_maker.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/support/several_scene.hpp"

namespace splid {
namespace {

using test::expect_is;
using test::off_of;
using test::scene_of;
using test::several;

TEST(TargetSelection, AreListedStrongestFirstWithTheirOwnValues) {
  const test::FrameMaker first = scene_of();
  const test::FrameMaker scenes[] = {scene_of(0.4, 20, 9e-4),    scene_of(0.5, 20, 13.5e-4),
                                     scene_of(0.7, 20, 13.5e-4), scene_of(6.7, 20, 9e-4),
                                     scene_of(200.1, -35, 9e-4), scene_of(0, 28, 9e-4)};
  FrameEstimator estimator = several(first, 2);
  for (const test::FrameMaker& second : scenes) {
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      const Estimate e = estimator.estimate(first.make_with({second}, seed).view());
      ASSERT_EQ(e.status, FrameStatus::ok);
      ASSERT_EQ(e.target_count, 2U);
      const bool in_order =
          std::abs(off_of(e.targets[0], first)) + std::abs(e.targets[0].velocity_mps - 20) <
          std::abs(off_of(e.targets[1], first)) + std::abs(e.targets[1].velocity_mps - 20);
      expect_is(e.targets[in_order ? 0 : 1], first);
      expect_is(e.targets[in_order ? 1 : 0], second);
      EXPECT_GE(e.targets[0].signal_per_pulse, e.targets[1].signal_per_pulse);
      EXPECT_EQ(e.delay_ns, e.targets[0].delay_ns);
      EXPECT_EQ(e.velocity_mps, e.targets[0].velocity_mps);
      EXPECT_EQ(e.significance_nats, e.targets[0].significance_nats);
    }
  }
}

TEST(TargetSelection, OneOfATwentiethIsFoundBesideTheOther) {
  const test::FrameMaker bright = scene_of(0, 20, 160e-4);
  const test::FrameMaker weak = scene_of(6.7, 20, 8e-4);
  FrameEstimator estimator = several(bright, 2);
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const Estimate e = estimator.estimate(bright.make_with({weak}, seed).view());
    ASSERT_EQ(e.target_count, 2U) << seed;
    expect_is(e.targets[0], bright);
    expect_is(e.targets[1], weak);
  }
}

TEST(TargetSelection, FourAreFoundWhereFourMayBe) {
  const test::FrameMaker first = scene_of();
  const std::vector<test::FrameMaker> others = {scene_of(6.7, 20, 12e-4), scene_of(13.4, 20, 11e-4),
                                                scene_of(90.3, -50, 10e-4)};
  for (const std::int64_t most : {3, 4}) {
    FrameEstimator estimator = several(first, most);
    const Estimate e = estimator.estimate(first.make_with(others, 3).view());
    EXPECT_EQ(e.target_count, static_cast<std::size_t>(most));
  }
}

// 180 ns before a target is a side lobe of half of its comb, 189 ns before it one of the other
// half. A target there, off by four widths, spreads the photons of the first one as two targets
// would, and is where it is.
TEST(TargetSelection, TheSideLobeOfAnotherIsNoSecondOfAPair) {
  const test::FrameMaker first = scene_of();
  FrameEstimator estimator = several(first, 2);
  for (const double period_ns : {180.0, 189.0}) {
    for (const double off_ns : {-0.4, 0.35, 0.4, 0.5}) {
      const test::FrameMaker second = scene_of(off_ns - period_ns, 20, 13e-4);
      for (std::uint64_t seed = 0; seed < 10; ++seed) {
        const Estimate e = estimator.estimate(first.make_with({second}, seed).view());
        ASSERT_EQ(e.target_count, 2U) << seed;
        const bool in_order = std::abs(off_of(e.targets[0], first)) < 0.1;
        expect_is(e.targets[in_order ? 0 : 1], first);
        expect_is(e.targets[in_order ? 1 : 0], second);
      }
    }
  }
}

// Two targets whose delays differ by a multiple of 9 ns make two more whole combs. (The two places
// of these were listed in a frame of ten, with status ok.)
TEST(TargetSelection, AreToldFromTheOtherPlacesOfTheirCombs) {
  const test::FrameMaker first = scene_of(0, 20, 33e-4);
  FrameEstimator estimator = several(first, 2);
  for (const double off_ns : {9.0, 27.0, 63.0, 99.0}) {
    const test::FrameMaker second = scene_of(off_ns, 20, 33e-4);
    for (std::uint64_t seed = 0; seed < 15; ++seed) {
      const Estimate e = estimator.estimate(first.make_with({second}, seed).view());
      ASSERT_EQ(e.target_count, 2U) << off_ns << ' ' << seed;
      if (e.targets[0].status == FrameStatus::ambiguous) continue;
      const bool in_order = std::abs(off_of(e.targets[0], first)) < 0.1;
      expect_is(e.targets[in_order ? 0 : 1], first);
      expect_is(e.targets[in_order ? 1 : 0], second);
      EXPECT_LT(e.targets[0].range_odds_nats, 80);
    }
  }
}

// A weaker one that has half of its pulses where the other has some was seen by its other half
// alone, which is as high at twenty places. (It was listed at a wrong one, with status ok, in one
// frame of twenty.)
TEST(TargetSelection, AWeakerOneAPeriodOfTheCombBehindIsWhereItIs) {
  const test::FrameMaker first = scene_of(0, 20, 20e-4);
  FrameEstimator estimator = several(first, 2);
  int sure = 0;
  for (const double off_ns : {180.0, 378.0}) {
    const test::FrameMaker second = scene_of(off_ns, 20, 6e-4);
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      const Estimate e = estimator.estimate(first.make_with({second}, seed).view());
      ASSERT_EQ(e.target_count, 2U) << off_ns << ' ' << seed;
      expect_is(e.targets[0], first);
      EXPECT_LT(std::abs(off_of(e.targets[1], second)), 0.1) << off_ns << ' ' << seed;
      sure += e.targets[1].status == FrameStatus::ok ? 1 : 0;
    }
  }
  EXPECT_GE(sure, 60);
}

// Where one target alone is looked for, one of the places where the combs of two meet may be the
// highest by chance. (Some such frames showed one, with status ok.) Other targets leave no doubt.
TEST(TargetSelection, LookedForAsOneAreInDoubtWhereTheirCombsMeet) {
  const test::FrameMaker first = scene_of(0, 20, 33e-4);
  FrameEstimator estimator = several(first, 1);
  for (const auto& [off_ns, least_sure, most_sure] : {std::tuple{63.0, 0, 30}, {65.0, 50, 60}}) {
    const test::FrameMaker second = scene_of(off_ns, 20, 33e-4);
    int sure = 0;
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
      const Estimate e = estimator.estimate(first.make_with({second}, seed).view());
      if (e.status != FrameStatus::ok) continue;
      ++sure;
      EXPECT_LT(std::min(std::abs(off_of(e.first_target(), first)),
                         std::abs(off_of(e.first_target(), second))),
                0.1)
          << seed;
    }
    EXPECT_GE(sure, least_sure) << off_ns;
    EXPECT_LE(sure, most_sure) << off_ns;
  }
}

// The combs of three targets and more meet at many places. (Some where no target is were listed,
// with status ok.)
TEST(TargetSelection, OfManyWhoseCombsMeetEachIsWhereItIs) {
  const double s = 33e-4;
  const std::vector<std::vector<test::FrameMaker>> scenes = {
      {scene_of(0, 20, s), scene_of(360, 20, s)},
      {scene_of(0, 20, s), scene_of(-207, 20, s), scene_of(288, 20, s)},
      {scene_of(0, 20, 1.7 * s), scene_of(455.1, 20, s), scene_of(203.1, 20, s)},
      {scene_of(0, 20, 2 * s), scene_of(-45, 20, 2.2 * s), scene_of(162, 20, 2.6 * s)},
      {scene_of(0, 20, s), scene_of(234, 20, s), scene_of(-261, 20, s), scene_of(-306, 20, s)}};
  for (const std::vector<test::FrameMaker>& scene : scenes) {
    FrameEstimator estimator = several(scene.front(), 4);
    const std::vector<test::FrameMaker> others(scene.begin() + 1, scene.end());
    std::size_t sure = 0;
    for (std::uint64_t seed = 0; seed < 15; ++seed) {
      const Estimate e = estimator.estimate(scene.front().make_with(others, seed).view());
      ASSERT_EQ(e.target_count, scene.size()) << seed;
      for (const TargetEstimate& target : std::span(e.targets).first(scene.size())) {
        if (target.status == FrameStatus::ambiguous) continue;
        ++sure;
        expect_is(target,
                  *std::min_element(scene.begin(), scene.end(), [&](const auto& a, const auto& b) {
                    return std::abs(off_of(target, a)) < std::abs(off_of(target, b));
                  }));
      }
    }
    EXPECT_GE(sure, 10 * scene.size()) << scene.size();
  }
}

// A row has more targets than are asked for: the brightest are listed, and the values of these know
// of the others.
// What the first search has come by of a bright target that moves by some m/s otherwise may be a
// line that crosses its path. In these two frames it was taken for the target.
TEST(TargetSelection, APartOfAnotherPathIsNoTarget) {
  test::FrameMaker first = scene_of();
  first.pattern = test::random_pattern(3780000, 40, 9000, 3);
  first.length_ms = 50;
  FrameEstimator estimator = several(first, 3);
  std::uniform_real_distribution<double> delay_ns(-1500, 1500), faster_mps(-15, 15);
  std::uniform_real_distribution<double> share(0.5, 1.5);
  for (const std::uint64_t seed : {977, 1016}) {
    std::mt19937_64 random(seed);
    std::vector<test::FrameMaker> others(2, first);
    for (test::FrameMaker& other : others) {
      other.distance_m += delay_ns(random) * test::several_c_m_per_ns / 2;
      other.velocity_mps += faster_mps(random);
      other.signal_per_pulse *= share(random);
    }
    const Estimate e = estimator.estimate(first.make_with(others, seed).view());
    for (const test::FrameMaker& other : others) {
      EXPECT_TRUE(std::any_of(e.targets.begin(), e.targets.begin() + e.target_count,
                              [&](const TargetEstimate& found) {
                                return std::abs(off_of(found, other)) < 0.1 &&
                                       std::abs(found.velocity_mps - other.velocity_mps) < 0.5;
                              }))
          << seed;
    }
  }
}

TEST(TargetSelection, NoMoreAreListedThanAreAskedFor) {
  const test::FrameMaker first = scene_of(0, 20, 70e-4);
  const test::FrameMaker second = scene_of(0.4, 20, 60e-4);
  const test::FrameMaker third = scene_of(0.8, 20, 50e-4);
  FrameEstimator estimator = several(first, 2);
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const Estimate e = estimator.estimate(first.make_with({second, third}, seed).view());
    ASSERT_EQ(e.target_count, 2U) << seed;
    expect_is(e.targets[0], first);
    expect_is(e.targets[1], second);
  }
}

// Targets that are as bright as each other are no doubt about each other's range. (The peak of a
// target that was not yet found used to count against the range of the target found before it,
// which left odds of 10 nats, and of less in weaker light.)
TEST(TargetSelection, DoNotCountAgainstEachOthersRange) {
  const test::FrameMaker first = scene_of();
  const std::vector<test::FrameMaker> others = {scene_of(6.7), scene_of(13.4), scene_of(90.3)};
  FrameEstimator estimator = several(first, 4);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Estimate e = estimator.estimate(first.make_with(others, seed).view());
    ASSERT_EQ(e.target_count, 4U);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_EQ(e.targets.at(k).status, FrameStatus::ok);
      EXPECT_GT(e.targets.at(k).range_odds_nats, 0.2 * e.targets.at(k).significance_nats) << seed;
    }
  }
}

void expect_same_target(const Estimate& a, const Estimate& b) {
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.delay_ns, b.delay_ns);
  EXPECT_EQ(a.velocity_mps, b.velocity_mps);
  EXPECT_EQ(a.signal_per_pulse, b.signal_per_pulse);
  EXPECT_EQ(a.std_delay_ns, b.std_delay_ns);
  EXPECT_EQ(a.significance_nats, b.significance_nats);
  EXPECT_EQ(a.range_odds_nats, b.range_odds_nats);
}

// Shoulders of the comb stand 40 deviations above the background here.
TEST(TargetSelection, ALoneTargetKeepsItsBitsAndHasNoShoulders) {
  const test::FrameMaker made = scene_of(0, 20, 80e-4);
  FrameEstimator one = several(made, 1), four = several(made, 4);
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const auto frame = made.make(seed);
    const Estimate e = four.estimate(frame.view());
    EXPECT_EQ(e.target_count, 0U) << seed;
    expect_same_target(e, one.estimate(frame.view()));
  }
}

// As close as 4 pulse widths, where the bright pulse has hardly any light, on either side.
TEST(TargetSelection, OneOfATwentiethIsFoundCloseBesideTheOther) {
  const test::FrameMaker bright = scene_of(0, 20, 160e-4);
  FrameEstimator estimator = several(bright, 2);
  for (const double off_ns : {-0.4, 0.4, 0.6}) {
    const test::FrameMaker weak = scene_of(off_ns, 20, 8e-4);
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      const Estimate e = estimator.estimate(bright.make_with({weak}, seed).view());
      ASSERT_EQ(e.target_count, 2U) << off_ns << " " << seed;
      expect_is(e.targets[0], bright);
      expect_is(e.targets[1], weak);
    }
  }
}

// Behind a weak pulse there is more light than the fit has, by two deviations, in one frame of
// fifty.
TEST(TargetSelection, ChanceBehindAClearRiseLosesNoTarget) {
  const test::FrameMaker bright = scene_of(0, 20, 160e-4);
  const test::FrameMaker weak = scene_of(0.85, 20, 8e-4);
  FrameEstimator estimator = several(bright, 2);
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const Estimate e = estimator.estimate(bright.make_with({weak}, seed).view());
    EXPECT_EQ(e.target_count, 2U) << seed;
  }
}

// A share of the light comes later, by an exponential delay, as a detector's tail does.
TEST(TargetSelection, ATailIsNoTarget) {
  int claimed = 0;  // of 200 frames
  for (const double tail_ns : {0.2, 0.4}) {
    test::FrameMaker made = scene_of(0, 20, 33e-4);
    made.late_share = 0.3;
    made.late_ns = tail_ns;
    FrameEstimator estimator = several(made, 2);
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
      claimed += estimator.estimate(made.make(seed).view()).target_count > 1 ? 1 : 0;
    }
  }
  EXPECT_LE(claimed, 4);
}

TEST(TargetSelection, AWidePulseIsNoTwoTargets) {
  int claimed = 0;  // of 1200 frames
  for (const double signal : {40e-4, 135e-4}) {
    for (const double sigma_ns : {0.08, 0.12, 0.15, 0.2, 0.25, 0.3}) {
      test::FrameMaker made = scene_of(0, 20, signal);
      made.sigma_ns = sigma_ns;
      FrameEstimator estimator = several(made, 3);
      for (int seed = 0; seed < test::times(100); ++seed) {
        claimed += estimator.estimate(made.make(seed).view()).target_count > 1 ? 1 : 0;
      }
    }
  }
  EXPECT_LE(claimed, 5);
}

TEST(TargetSelection, AtRestAreFoundAtRest) {
  const test::FrameMaker first = scene_of(0, 0), second = scene_of(0.5, 0, 9e-4);
  SceneOptions still;
  still.motion = Motion::static_target;
  FrameEstimator estimator = several(first, 2, still);
  const Estimate e = estimator.estimate(first.make_with({second}, 4).view());
  ASSERT_EQ(e.target_count, 2U);
  EXPECT_EQ(e.targets[1].velocity_mps, 0);
  EXPECT_EQ(e.targets[1].std_velocity_mps, 0);
  EXPECT_LT(std::abs(off_of(e.targets[1], second)), 5 * e.targets[1].std_delay_ns);
  // One that moves after all is noticed, as it is alone.
  const Estimate moving = estimator.estimate(first.make_with({scene_of(6.7, 40, 9e-4)}, 4).view());
  EXPECT_EQ(moving.target_count, 0U);
}

TEST(TargetSelection, EstimatesDoNotAllocate) {
  const double s = 60e-4;
  const test::FrameMaker first = scene_of(0, 20, s);
  FrameEstimator estimator = several(first, 4);
  // A pair, a row of three, a pair with two other places, and a side lobe of another target.
  const std::vector<std::vector<test::FrameMaker>> others = {
      {scene_of(0.4, 20, s)},
      {scene_of(0.4, 20, s), scene_of(0.8, 20, s)},
      {scene_of(63, 20, s)},
      {scene_of(0.4 - 180, 20, s)}};
  for (const std::vector<test::FrameMaker>& other : others) {
    const auto frame = first.make_with(other, 1);
    estimator.estimate(frame.view());
    const std::uint64_t before = test::allocations;
    const Estimate e = estimator.estimate(frame.view());
    EXPECT_EQ(test::allocations, before);
    EXPECT_EQ(e.target_count, other.size() + 1);
  }
}

TEST(TargetSelection, AreRefusedWithWhatKnowsOneTarget) {
  const test::FrameMaker made = scene_of();
  SceneOptions scene;
  scene.targets = 2;
  EstimatorOptions paper;
  paper.method = Method::paper;
  EXPECT_THROW(FrameEstimator(made.pattern, {}, scene, paper, 20, 1000), Error);
}

}  // namespace
}  // namespace splid
