#include "drivers/simulator/scanner.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/simulator/array_pixels.hpp"
#include "drivers/simulator/scene_truth.hpp"
#include "protocol/truth.hpp"
#include "tests/support/scene_runs.hpp"

namespace splid::simulator {
namespace {

using test::noiseless_scene;
using test::one_segment;
using test::simulate;
using testing::HasSubstr;

constexpr std::int64_t ms = 1'000'000'000;

Plane wall_at(double distance_m) {
  Plane plane;
  plane.path.motion = MotionKind::linear;
  plane.path.distance_m = distance_m;
  return plane;
}

// 3 x 2 pixels before a wall, without noise.
Options scan() {
  Options options = noiseless_scene();
  options.array.columns = 3;
  options.array.rows = 2;
  options.array.pitch_deg = 10;
  options.array.planes = {wall_at(30)};
  options.scanner.dwell_ms = 1;
  return options;
}

std::vector<std::pair<std::int64_t, int>> markers(const std::vector<Tag>& tags) {
  std::vector<std::pair<std::int64_t, int>> found;
  for (const Tag& tag : tags) {
    if (tag.kind == TagKind::marker) found.emplace_back(tag.time_ps, tag.value);
  }
  return found;
}

TEST(Scanner, AStopComesBeforeTheStartAtItsTime) {
  Options options = scan();
  options.start_ps = 7000;
  options.scanner.start_ms = 0.5;
  options.seconds = 0.01;
  const std::vector<std::pair<std::int64_t, int>> expected = {
      {7000 + ms / 2, 1 | 4},  {7000 + 7 * ms / 2, 2},      {7000 + 7 * ms / 2, 1},
      {7000 + 13 * ms / 2, 2}, {7000 + 13 * ms / 2, 1 | 4}, {7000 + 19 * ms / 2, 2},
      {7000 + 19 * ms / 2, 1}};
  EXPECT_EQ(markers(simulate(options, test::paper_pattern())), expected);
}

TEST(Scanner, AStreamMayStartWithinALine) {
  Options options = scan();
  options.scanner.start_ms = -4.5;
  options.seconds = 0.005;
  const std::vector<std::pair<std::int64_t, int>> expected = {
      {3 * ms / 2, 2}, {3 * ms / 2, 1 | 4}, {9 * ms / 2, 2}, {9 * ms / 2, 1}};
  EXPECT_EQ(markers(simulate(options, test::paper_pattern())), expected);
  const Scanner scanner(options.scanner, 3, 2);
  EXPECT_EQ(scanner.pixel_at(0), 4U);  // the fifth dwell of the picture
  EXPECT_EQ(scanner.pixel_at(3 * ms / 2), 0U);
}

TEST(Scanner, MarkersAreThoseOfTheOptionsBesideAnEncoder) {
  Options options = scan();
  options.scanner.line_start_marker = 2;
  options.scanner.line_stop_marker = 4;
  options.scanner.frame_marker = 0;
  options.scanner.return_ms = 0.25;
  options.encoder_rate_hz = 500;
  options.encoder_start_s = 0.001;
  options.seconds = 0.0065;
  EXPECT_FALSE(options.validate());
  const std::vector<std::pair<std::int64_t, int>> expected = {
      {0, 2}, {ms, 1}, {3 * ms, 1}, {3 * ms, 4}, {5 * ms, 1}, {13 * ms / 4, 2}, {25 * ms / 4, 4}};
  EXPECT_THAT(markers(simulate(options, test::paper_pattern())),
              testing::UnorderedElementsAreArray(expected));
}

// Photons that light left for in a dwell, by the pixel: all at the delay of the pixel's wall.
TEST(Scanner, EachDwellHasThePhotonsOfItsPixel) {
  for (const bool both_ways : {false, true}) {
    Options options = scan();
    options.scanner.both_ways = both_ways;
    options.scanner.return_ms = 0.5;
    options.detection.signal_per_pulse = 100;  // nothing of a scan takes it
    options.array.planes[0].signal_per_pulse = 0.5;
    options.array.planes[0].tilt_azimuth_deg = 20;  // no row is its own mirror image
    options.array.planes.push_back(wall_at(20));    // the lower row's
    options.array.planes[1].tilt_azimuth_deg = 20;
    options.array.planes[1].field.elevation_deg = {-10, 0};
    options.array.planes[1].signal_per_pulse = 0.25;
    options.seconds = 0.015;
    const std::vector<ArrayPixel> pixels = array_pixels(options);
    // In the order of time, of two pictures of 7 ms.
    std::vector<std::size_t> order = {0, 1, 2, 3, 4, 5};
    if (both_ways) order = {0, 1, 2, 5, 4, 3};
    std::map<std::size_t, int> counts;
    const double light_m = 299'792'458e-12;
    for (const Tag& tag : simulate(options, one_segment(1e6, {0}, {1}))) {
      if (tag.kind != TagKind::photon) continue;
      ASSERT_EQ(tag.value, 1);
      const std::int64_t left_ps = tag.time_ps / 1'000'000 * 1'000'000;
      const std::int64_t in_line_ps = left_ps % (7 * ms / 2);
      ASSERT_LT(in_line_ps, 3 * ms);
      const std::size_t pixel =
          order[static_cast<std::size_t>(left_ps / (7 * ms / 2) % 2 * 3 + in_line_ps / ms)];
      const double distance_m = pixels[pixel].scene.target.distance_m;
      ASSERT_NEAR(static_cast<double>(tag.time_ps - left_ps), 2 * distance_m / light_m, 0.6);
      if (left_ps < 14 * ms) ++counts[pixel];
    }
    for (std::size_t k = 0; k < 6; ++k) {
      const double expected = 2 * 1000 * (k < 3 ? 0.5 : 0.25);
      EXPECT_NEAR(counts[k], expected, 5 * std::sqrt(expected)) << k;
    }
  }
}

// Light from 10 m overtakes light from 500 m, which left 3.2 us before it.
TEST(Scanner, TagsAreSortedWhereNearPixelsFollowFarOnes) {
  Options options = scan();
  options.array.rows = 1;
  options.array.planes = {wall_at(500), wall_at(10)};
  options.array.planes[1].field.azimuth_deg = {-5, 5};
  for (Plane& plane : options.array.planes) plane.signal_per_pulse = 5;
  options.scanner.dwell_ms = 0.0312;  // boundaries of dwells pass over those of the slices
  options.seconds = 0.05;
  const std::vector<Tag> tags = simulate(options, one_segment(1e6, {0}, {1}));
  EXPECT_TRUE(std::is_sorted(tags.begin(), tags.end(),
                             [](const Tag& a, const Tag& b) { return a.time_ps < b.time_ps; }));
  EXPECT_GT(tags.size(), 200'000U);
}

TEST(Scanner, OneSeedGivesOneStream) {
  Options options = scan();
  options.ambient_per_s = 1e5;
  const std::vector<Tag> first = simulate(options, test::paper_pattern());
  EXPECT_EQ(first, simulate(options, test::paper_pattern()));
  options.seed = 2;
  EXPECT_NE(first, simulate(options, test::paper_pattern()));
}

TEST(Scanner, TheSourceTellsItsLines) {
  const auto told = [](const Options& options) {
    const Pattern pattern = test::paper_pattern();
    SourceContext context;
    context.pattern = &pattern;
    return options.open(context)->info().scan;
  };
  Options options = scan();
  EXPECT_EQ(told(options), (ScanLines{1, 2, 3, 4, 2, false, 0}));
  options.pace = Speed::live;
  options.scanner.line_stop_marker = 8;
  options.scanner.frame_marker = 0;
  options.scanner.both_ways = true;
  EXPECT_EQ(told(options), (ScanLines{1, 8, 3, 0, 2, true, 0}));
  options.scanner.dwell_ms = 0;
  EXPECT_FALSE(told(options));
}

// The walls swing faster than a picture is made.
TEST(Scanner, TheTruthHasASampleInTheMiddleOfEachDwell) {
  Options options = scan();
  options.photon_input = 5;
  options.start_ps = 7000;
  options.seconds = 0.03;
  options.scanner.start_ms = -3.7;
  options.scanner.return_ms = 0.25;
  options.scanner.both_ways = true;
  Plane& wall = options.array.planes[0];
  wall.path.motion = MotionKind::sinusoid;
  wall.path.amplitude_m = 2;
  wall.path.period_s = 0.005;
  wall.tilt_azimuth_deg = 20;
  const SceneTruth truth = truth_from_json(to_json(scene_truth(options)));
  EXPECT_EQ(truth.dwell_ps, ms);
  ASSERT_EQ(truth.pixels.size(), 6U);
  const std::vector<ArrayPixel> pixels = array_pixels(options);
  const Scanner scanner(options.scanner, 3, 2);
  std::size_t dwells = 0;
  for (std::int64_t line = 0; line < 11; ++line) {
    for (std::int64_t dwell = 0; dwell < 3; ++dwell) {
      const std::int64_t middle_ps = -37 * ms / 10 + line * 13 * ms / 4 + dwell * ms + ms / 2;
      if (middle_ps < 0 || middle_ps >= 30 * ms) continue;
      const std::size_t k = scanner.pixel_at(middle_ps).value();
      const auto state = truth.at(7000 + middle_ps).value();
      const TargetPath path(pixels[k].scene.target);
      const MotionState there = path.at(static_cast<double>(middle_ps) * 1e-12);
      EXPECT_NEAR(state.distance_m, there.distance_m, 1e-9) << line << ' ' << dwell;
      EXPECT_NEAR(state.velocity_mps, there.velocity_mps, 1e-6) << line << ' ' << dwell;
      EXPECT_EQ(truth.at(7000 + middle_ps, truth.pixels[k])->distance_m, state.distance_m);
      ++dwells;
    }
  }
  EXPECT_EQ(dwells, 28U);
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_EQ(truth.pixels[k].input, 5);
    EXPECT_EQ(truth.pixels[k].azimuth_deg, -10 + 10 * static_cast<double>(k % 3));
    EXPECT_EQ(truth.pixels[k].elevation_deg, k < 3 ? 5 : -5);
  }
  const std::int64_t return_ps = -37 * ms / 10 + 13 * ms / 4 - ms / 8 + 13 * ms / 4;
  EXPECT_FALSE(scanner.pixel_at(return_ps));
  EXPECT_FALSE(truth.at(7000 + return_ps)) << "between two lines";
}

// Of 3 x 2 pixels of 1 ns each, in 10 s: as many pictures as 600,000 samples are enough for.
TEST(Scanner, TheTruthOfALongScanIsOfSomePictures) {
  Options options = scan();
  options.scanner.dwell_ms = 1e-6;
  options.seconds = 10;
  const SceneTruth truth = scene_truth(options);
  EXPECT_EQ(truth.step_ps % 6000, 0);
  EXPECT_LE(truth.pixels[5].distance_m.size(), 100'001U);
  EXPECT_GE(truth.pixels[5].distance_m.size(), 99'000U);
}

TEST(Scanner, FaultsOfTheOptionsSayWhatToDo) {
  Options options = scan();
  EXPECT_FALSE(options.validate());
  options.scanner.line_stop_marker = 5;
  EXPECT_EQ(options.validate().value().pointer, "/scanner/line_stop_marker");
  EXPECT_THAT(options.validate()->what, HasSubstr("is 5; it shares a bit with line_start_marker"));
  options = scan();
  options.encoder_rate_hz = 1000;
  EXPECT_EQ(options.validate().value().pointer, "/scanner/line_start_marker");
  EXPECT_THAT(options.validate()->what, HasSubstr("encoder's sample clock"));
  options = scan();
  options.array.crosstalk_probability = 0.1;
  EXPECT_EQ(options.validate().value().pointer, "/array/crosstalk_probability");
  options.array.inputs.resize(1);
  EXPECT_EQ(options.validate().value().pointer, "/array/inputs");
  options = scan();
  options.array.planes[0].field.azimuth_deg = {1};
  EXPECT_EQ(options.validate().value().pointer, "/array/planes/0/azimuth_deg");
  options = scan();
  options.array.columns = 0;
  EXPECT_EQ(options.validate().value().pointer, "/scanner/dwell_ms");
  EXPECT_THAT(options.validate()->what, HasSubstr("columns and rows"));
  options = scan();
  options.detector.inputs = 2;  // one direction, its light split
  EXPECT_FALSE(options.validate());
}

}  // namespace
}  // namespace splid::simulator
