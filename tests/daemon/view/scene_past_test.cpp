#include "daemon/view/scene_past.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "protocol/frame_columns.hpp"

namespace splid::view {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

// Of the pixels a and b, of which b shows nothing.
SceneMessage past_scene(double timestamp_s, double distance_m) {
  SceneMessage scene;
  scene.whole.timestamp_s = timestamp_s;
  scene.whole.duration_ms = 50;
  scene.whole.effort = "balanced";
  FrameMessage found;
  found.status = FrameStatus::ok;
  found.distance_m = distance_m;
  found.std_distance_m = 0.25;
  FrameMessage nothing;
  nothing.status = FrameStatus::no_target;
  scene.pixels = {{"a", {}, {}, found}, {"b", {}, {}, nothing}};
  return scene;
}

// The times and the distances, -1 where there is none.
std::vector<std::pair<double, double>> past_of(const ScenePast& past, const std::string& pixel) {
  std::vector<std::pair<double, double>> all;
  past.tell(pixel, [&](const FrameMessage& frame, std::int64_t /*came_ns*/) {
    all.emplace_back(frame.timestamp_s, frame.distance_m.value_or(-1));
  });
  return all;
}

TEST(ScenePast, TellsThePastOfAnyPixel) {
  ScenePast past;
  past.add(past_scene(10, 20), 5);
  past.add(past_scene(10.05, 21), 6);
  EXPECT_THAT(past_of(past, "a"), ElementsAre(Pair(10, 20), Pair(10.05, 21)));
  EXPECT_THAT(past_of(past, "b"), ElementsAre(Pair(10, -1), Pair(10.05, -1)));
  EXPECT_THAT(past_of(past, "c"), IsEmpty());
  const auto last = past.last_of("a");
  ASSERT_TRUE(last);
  EXPECT_EQ(to_json(*last),
            R"({"schema":"splid.frame","v":[1,0],"timestamp":10.05,"sequence":0,"status":"ok",)"
            R"("valid":true,"mode":"baseline","start_ps":"0","duration_ms":50,"distance_m":21,)"
            R"("std":{"distance_m":0.25},"effort":"balanced","pixel":"a"})");
  EXPECT_FALSE(past.last_of("c"));
}

TEST(ScenePast, BeginsAnewWithAnotherReplayAndOtherPixels) {
  ScenePast past;
  past.add(past_scene(100, 20), 0);
  past.add(past_scene(99.5, 21), 0);  // a clock set back a little
  EXPECT_EQ(past.size(), 2U);
  past.add(past_scene(50, 22), 0);
  EXPECT_THAT(past_of(past, "a"), ElementsAre(Pair(50, 22)));
  SceneMessage others = past_scene(51, 23);
  others.pixels[0].name = "c";
  past.add(others, 0);
  EXPECT_THAT(past_of(past, "a"), IsEmpty());
  EXPECT_THAT(past_of(past, "c"), ElementsAre(Pair(51, 23)));
  past.forget();
  EXPECT_TRUE(past.empty());
}

TEST(ScenePast, KeepsSoManyScenesAndSoManyBytes) {
  ScenePast past;
  for (std::size_t i = 0; i <= ScenePast::most_scenes; ++i) {
    past.add(past_scene(1000 + static_cast<double>(i), 20), 0);
  }
  EXPECT_EQ(past.size(), ScenePast::most_scenes);
  EXPECT_EQ(past.csv("a", 1000, 1002), std::nullopt);
  SceneMessage large = past_scene(1e6, 20);
  large.pixels.resize(10'000, large.pixels.back());
  for (int i = 0; i < 200; ++i) past.add(large, 0);
  EXPECT_LT(past.size(), 100U);
  EXPECT_GT(past.size(), 50U);
}

TEST(ScenePast, HasAPixelsFramesAsATable) {
  ScenePast past;
  for (int i = 0; i < 4; ++i) past.add(past_scene(100 + i, 20 + i), 0);
  std::string expected = frame_csv_head();
  past.tell("a", [&](const FrameMessage& frame, std::int64_t /*came_ns*/) {
    if (frame.timestamp_s == 101 || frame.timestamp_s == 102) expected += frame_csv_row(frame);
  });
  EXPECT_EQ(past.csv("a", 101, 102), expected);
}

}  // namespace
}  // namespace splid::view
