#include "daemon/stream/timing_walk.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "daemon/stream/framer.hpp"
#include "drivers/simulator/scene_truth.hpp"
#include "drivers/simulator/simulator.hpp"
#include "estimator/frame_estimator.hpp"
#include "estimator/model/units.hpp"
#include "tests/support/frame_list.hpp"
#include "tests/support/known_truth.hpp"
#include "tests/support/scene_runs.hpp"

namespace splid {
namespace {

using testing::ElementsAre;

constexpr std::array<NumberPair, 3> table = {{{50, 150}, {150, 50}, {200, -20}}};

std::vector<std::int64_t> without_walk(const std::vector<std::int64_t>& times_ps) {
  TimingWalk walk(table, 1);
  std::vector<std::int64_t> all;
  for (const std::int64_t time_ps : times_ps) all.push_back(walk.without(time_ps, 0));
  return all;
}

TEST(TimingWalk, IsLinearBetweenRowsAndNoneBehindTheLast) {
  EXPECT_THAT(without_walk({0, 10'000}), ElementsAre(0, 9'850));  // as the first row says
  EXPECT_THAT(without_walk({0, 50'000}), ElementsAre(0, 49'850));
  EXPECT_THAT(without_walk({0, 100'000}), ElementsAre(0, 99'900));
  EXPECT_THAT(without_walk({0, 150'000}), ElementsAre(0, 149'950));
  EXPECT_THAT(without_walk({0, 175'000}), ElementsAre(0, 174'985));
  EXPECT_THAT(without_walk({0, 200'000}), ElementsAre(0, 200'020));
  EXPECT_THAT(without_walk({0, 200'001}), ElementsAre(0, 200'001));
}

// 50,000 ps after the first one's true time; the second one's true time is 49,850.
TEST(TimingWalk, WaitsBeginAtTheTimeWithoutWalk) {
  EXPECT_THAT(without_walk({0, 50'000, 149'850, 300'000}),
              ElementsAre(0, 49'850, 149'750, 299'950));
}

TEST(TimingWalk, InputsWaitEachOnTheirOwn) {
  TimingWalk walk(table, 2);
  EXPECT_EQ(walk.without(0, 0), 0);
  EXPECT_EQ(walk.without(50'000, 1), 50'000);
  EXPECT_EQ(walk.without(100'000, 1), 99'850);
  EXPECT_EQ(walk.without(150'000, 0), 149'950);
}

TEST(TimingWalk, TimesThatGoBackOrAreExtremeAreTakenAsTheyAre) {
  EXPECT_THAT(without_walk({INT64_MIN, INT64_MAX, 0, 10'000, 5'000, 55'000}),
              ElementsAre(INT64_MIN, INT64_MAX, 0, 9'850, 5'000, 54'850));
}

// Delays of a simulated target of [P]'s pattern before a detector with walk: how far they are off
// in their own deviations, root mean square, and on average; and the mean deviation.
struct Pull {
  double rms = 0, mean_ps = 0, deviation_ps = 0;
  std::size_t frames = 0;
};

Pull pull(const std::vector<NumberPair>& told) {
  simulator::Options scene;
  scene.pace = simulator::Speed::max;
  scene.seconds = 0.55;
  scene.target.motion = simulator::MotionKind::linear;
  scene.target.distance_m = 200;
  scene.target.velocity_mps = 10;
  scene.detection.signal_per_pulse = 0.1;
  scene.detector.dead_time_ns = 50;
  scene.detector.walk = {{50, 150}, {200, 20}};
  const Pattern pattern = test::paper_pattern();
  test::FrameList frames({1 << 16, 1 << 15, 1 << 10, 64});
  const ChannelMap channels{ChannelOptions{}};
  Framer framer(framer_options(50, pattern, DriftMethod::regression, told), channels, frames);
  framer.push(test::simulate(scene, pattern), 0);
  framer.finish();
  FrameEstimator estimator(pattern, {}, {}, {}, 50, 1 << 16, ClockReference::tagger,
                           {scene.detector.dead_time_ns});
  const SceneTruth truth = simulator::scene_truth(scene);
  Pull all;
  for (const auto& frame : frames.frames) {
    const auto state = truth.at(frame->view().mid_ps());
    const Estimate found = estimator.estimate(frame->view());
    if (found.status != FrameStatus::ok || !state) continue;
    const double off_ns = found.delay_ns - 2e9 * state->distance_m / speed_of_light_mps;
    all.rms += std::pow(off_ns / found.std_delay_ns, 2);
    all.mean_ps += off_ns * 1e3, all.deviation_ps += found.std_delay_ns * 1e3, ++all.frames;
  }
  const auto count = static_cast<double>(all.frames);
  return {std::sqrt(all.rms / count), all.mean_ps / count, all.deviation_ps / count, all.frames};
}

TEST(TimingWalk, DistancesAreRightToTheirDeviationsWithTheTable) {
  const Pull right = pull({{50, 150}, {200, 20}});
  EXPECT_GE(right.frames, 10U);
  EXPECT_LT(right.rms, 2.1);  // chi squared of 10: above in one of a million
  EXPECT_LT(std::abs(right.mean_ps), 4 * right.deviation_ps / std::sqrt(10));
  EXPECT_GT(pull({}).mean_ps, 5 * right.deviation_ps);
}

}  // namespace
}  // namespace splid
