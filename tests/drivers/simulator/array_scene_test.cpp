#include "drivers/simulator/array_scene.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tests/support/scene_runs.hpp"

namespace splid::simulator {
namespace {

using test::noiseless_scene;
using test::one_segment;
using test::paper_pattern;
using test::simulate;
using test::times_ps;

Plane plane_at(double distance_m, double velocity_mps) {
  Plane plane;
  plane.path.motion = MotionKind::linear;
  plane.path.distance_m = distance_m;
  plane.path.velocity_mps = velocity_mps;
  return plane;
}

// 3 x 2 pixels before a wall at 30 m.
Options wall() {
  Options options;
  options.pace = Speed::max;
  options.seconds = 0.02;
  options.array.columns = 3;
  options.array.rows = 2;
  options.array.planes = {plane_at(30, 0)};
  return options;
}

std::vector<std::int64_t> of_input(const std::vector<Tag>& tags, int input) {
  std::vector<std::int64_t> times;
  for (const Tag& tag : tags) {
    if (tag.kind == TagKind::photon && tag.value == input) times.push_back(tag.time_ps);
  }
  return times;
}

TEST(ArrayScene, TagsAreSortedAndEachInputCounts) {
  Options options = wall();
  options.encoder_rate_hz = 10'000;
  options.encoder_start_s = 0;
  options.array.crosstalk_probability = 0.1;
  options.array.inputs.resize(1);
  options.array.inputs[0].input = 2;
  options.array.inputs[0].delay_ps = 5e5;
  const std::vector<Tag> tags = simulate(options, paper_pattern());
  EXPECT_TRUE(std::is_sorted(tags.begin(), tags.end(),
                             [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; }));
  for (int input = 1; input <= 6; ++input) EXPECT_GT(of_input(tags, input).size(), 3000U);
  EXPECT_TRUE(of_input(tags, 0).empty());
  EXPECT_TRUE(of_input(tags, 7).empty());
  Options single = wall();
  single.array = {};
  single.encoder_rate_hz = 10'000;
  single.encoder_start_s = 0;
  const std::vector<Tag> alone = simulate(single, paper_pattern());
  EXPECT_EQ(times_ps(tags, TagKind::sync), times_ps(alone, TagKind::sync));
  EXPECT_EQ(times_ps(tags, TagKind::marker), times_ps(alone, TagKind::marker));
}

TEST(ArrayScene, OneSeedGivesOneStreamAndNoTwoPixelsTheSame) {
  Options options = wall();
  const std::vector<Tag> first = simulate(options, paper_pattern());
  EXPECT_EQ(first, simulate(options, paper_pattern()));
  EXPECT_NE(of_input(first, 1), of_input(first, 2));
  options.seed = 2;
  const std::vector<Tag> second = simulate(options, paper_pattern());
  EXPECT_NE(first, second);
  options.seed = 3;
  const std::vector<Tag> third = simulate(options, paper_pattern());
  for (int input = 1; input <= 6; ++input)
    EXPECT_NE(of_input(second, input), of_input(third, input));
}

// Without noise all photons of a pixel are at the delay of what it looks at, and of its cable.
TEST(ArrayScene, EachPixelHasItsOwnDistanceAndDelay) {
  Options options = noiseless_scene();
  options.detection.signal_per_pulse = 1;
  options.array.columns = 3;
  options.array.planes = {plane_at(30, 0)};
  options.array.inputs.resize(2);
  options.array.inputs[0].input = 1;
  options.array.inputs[0].distance_m = 15;
  options.array.inputs[1].input = 3;
  options.array.inputs[1].delay_ps = 2500;
  const std::vector<Tag> tags = simulate(options, one_segment(1e6, {0}, {1}));
  const double light = 299'792'458e-12;
  const double tilted_m = 30 / std::cos(0.1 / 180 * std::acos(-1));
  const std::array<double, 3> delays_ps = {30 / light, 60 / light, 2 * tilted_m / light + 2500};
  for (int pixel = 0; pixel < 3; ++pixel) {
    const std::vector<std::int64_t> times = of_input(tags, 1 + pixel);
    ASSERT_GT(times.size(), 50U);
    for (const std::int64_t time_ps : times) {
      EXPECT_NEAR(static_cast<double>(time_ps % 1'000'000), delays_ps[pixel], 0.6);
    }
  }
}

// The photons of the neighbours follow those of the only pixel with light.
TEST(ArrayScene, CrosstalkFallsOnNeighbours) {
  Options options = noiseless_scene();
  options.detection.signal_per_pulse = 0;
  options.array.columns = 3;
  options.array.rows = 3;
  options.array.inputs.resize(1);
  options.array.inputs[0].input = 5;
  options.array.inputs[0].dark_per_s = 1e6;
  options.array.crosstalk_probability = 0.2;
  options.array.crosstalk_ns = 2;
  options.seconds = 0.1;
  const std::vector<Tag> tags = simulate(options, paper_pattern());
  const std::vector<std::int64_t> lit = of_input(tags, 5);
  double waits_ps = 0;
  std::size_t beside = 0;
  for (const int input : {2, 4, 6, 8}) {
    const std::vector<std::int64_t> times = of_input(tags, input);
    EXPECT_NEAR(static_cast<double>(times.size()), 0.05 * 1e5, 5 * std::sqrt(0.05 * 1e5));
    for (const std::int64_t time_ps : times) {
      const auto after = std::upper_bound(lit.begin(), lit.end(), time_ps);
      if (after == lit.begin()) continue;
      waits_ps += static_cast<double>(time_ps - after[-1]);
      ++beside;
    }
  }
  // Crosstalk of crosstalk comes later: some 0.2 of it, by 4 ns instead of 2.
  EXPECT_NEAR(waits_ps / static_cast<double>(beside), 2000, 250);
  for (const int input : {1, 3, 7, 9}) {
    EXPECT_LT(of_input(tags, input).size(), 0.03 * 1e5);
  }
}

TEST(ArrayScene, ADeadDetectorMissesCrosstalk) {
  Options options = noiseless_scene();
  options.detection.signal_per_pulse = 0;
  options.ambient_per_s = 2e6;
  options.array.columns = 2;
  options.array.crosstalk_probability = 0.5;
  options.detector.dead_time_ns = 100;
  const std::vector<Tag> tags = simulate(options, paper_pattern());
  for (const int input : {1, 2}) {
    const std::vector<std::int64_t> times = of_input(tags, input);
    ASSERT_GT(times.size(), 50'000U);
    for (std::size_t i = 1; i < times.size(); ++i) ASSERT_GE(times[i] - times[i - 1], 100'000);
  }
}

TEST(ArrayScene, SyncsNextToPhotonsOfAnyPixelPass) {
  Options options = noiseless_scene();
  options.sync.near_photons_only = true;
  options.detection.signal_per_pulse = 0;
  options.array.columns = 2;
  options.array.inputs.resize(1);
  options.array.inputs[0].input = 2;
  options.array.inputs[0].dark_per_s = 1000;
  const std::vector<Tag> tags = simulate(options, paper_pattern());
  const std::size_t photons = times_ps(tags, TagKind::photon).size();
  const std::size_t syncs = times_ps(tags, TagKind::sync).size();
  EXPECT_GT(photons, 20U);
  EXPECT_LE(syncs, photons);
  EXPECT_GE(syncs + 3, photons);
}

}  // namespace
}  // namespace splid::simulator
