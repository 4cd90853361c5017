#include "protocol/scene_json.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "protocol/error.hpp"
#include "tests/support/error_text.hpp"

namespace splid {
namespace {

SceneMessage scene_of(std::uint64_t count, double value) {
  SceneMessage scene;
  FrameMessage& whole = scene.whole;
  whole.timestamp_s = value;
  whole.sequence = count;
  whole.start_ps = static_cast<std::int64_t>(count);
  whole.duration_ms = value;
  whole.lost_tags = count;
  whole.seen_fraction = value;
  whole.sync = {count, count, count, value, value, value};
  whole.effort = "balanced";
  whole.compute_ms = value;
  whole.latency_ms = value;
  FrameMessage found;
  found.status = FrameStatus::ok;
  found.distance_m = found.velocity_mps = found.signal_per_pulse = value;
  found.background_per_s = found.significance = value;
  found.std_distance_m = found.std_velocity_mps = value;
  found.std_signal_per_pulse = found.std_background_per_s = value;
  FrameMessage nothing;
  nothing.status = FrameStatus::no_target;
  scene.pixels = {{"a1", value, -value, found}, {"b", {}, {}, nothing}};
  return scene;
}

TEST(SceneJson, OfZeroIsPinned) {
  EXPECT_EQ(
      to_json(scene_of(0, 0)),
      R"({"schema":"splid.scene","v":[1,0],"timestamp":0,"sequence":0,"start_ps":"0",)"
      R"("duration_ms":0,"lost_tags":0,"seen_fraction":0,)"
      R"("sync":{"count":0,"missing":0,"spurious":0,"period_ps":0,"drift_ppm":0,"jitter_ps":0},)"
      R"("pixel":["a1","b"],"azimuth_deg":[0,null],"elevation_deg":[0,null],)"
      R"("status":["ok","no_target"],"distance_m":[0,null],"velocity_mps":[0,null],)"
      R"("signal_per_pulse":[0,null],"background_per_s":[0,null],"significance":[0,null],)"
      R"("std":{"distance_m":[0,null],"velocity_mps":[0,null],"signal_per_pulse":[0,null],)"
      R"("background_per_s":[0,null]},"effort":"balanced","compute_ms":0,"latency_ms":0})");
}

TEST(SceneJson, OfTheLargestNumbersIsPinned) {
  SceneMessage scene = scene_of(1, 0.25);
  scene.whole.start_ps = std::numeric_limits<std::int64_t>::max();
  scene.whole.sequence = std::numeric_limits<std::uint64_t>::max();
  scene.whole.sync.reset();
  scene.whole.uncounted_losses = 1;
  scene.pixels[0].frame.distance_m = std::numeric_limits<double>::max();
  scene.pixels[0].frame.velocity_mps = std::numeric_limits<double>::quiet_NaN();
  for (auto& pixel : scene.pixels) pixel.azimuth_deg = pixel.elevation_deg = std::nullopt;
  EXPECT_EQ(to_json(scene),
            R"({"schema":"splid.scene","v":[1,0],"timestamp":0.25,"sequence":18446744073709551615,)"
            R"("start_ps":"9223372036854775807","duration_ms":0.25,"lost_tags":1,)"
            R"("uncounted_losses":1,"seen_fraction":0.25,"pixel":["a1","b"],)"
            R"("status":["ok","no_target"],"distance_m":[1.7976931348623157e+308,null],)"
            R"("velocity_mps":[null,null],"signal_per_pulse":[0.25,null],)"
            R"("background_per_s":[0.25,null],"significance":[0.25,null],)"
            R"("std":{"distance_m":[0.25,null],"velocity_mps":[0.25,null],)"
            R"("signal_per_pulse":[0.25,null],"background_per_s":[0.25,null]},)"
            R"("effort":"balanced","compute_ms":0.25,"latency_ms":0.25})");
}

TEST(SceneJson, ReadsBackWhatItWrites) {
  SceneMessage all = scene_of(3, 1.5);
  all.whole.uncounted_losses = 2;
  EXPECT_EQ(to_json(scene_from_json(to_json(all))), to_json(all));
  const SceneMessage read = scene_from_json(to_json(scene_of(3, 1.5)));
  EXPECT_EQ(read.whole.timestamp_s, 1.5);
  EXPECT_EQ(read.whole.sequence, 3U);
  EXPECT_EQ(read.whole.start_ps, 3);
  EXPECT_EQ(read.whole.duration_ms, 1.5);
  ASSERT_EQ(read.pixels.size(), 2U);
  EXPECT_EQ(read.pixels[0].name, "a1");
  EXPECT_EQ(read.pixels[0].azimuth_deg, 1.5);
  EXPECT_EQ(read.pixels[0].elevation_deg, -1.5);
  EXPECT_EQ(read.pixels[0].frame.status, FrameStatus::ok);
  EXPECT_EQ(read.pixels[0].frame.distance_m, 1.5);
  EXPECT_EQ(read.pixels[0].frame.std_velocity_mps, 1.5);
  EXPECT_EQ(read.pixels[1].frame.status, FrameStatus::no_target);
  EXPECT_EQ(read.pixels[1].frame.distance_m, std::nullopt);
  EXPECT_EQ(read.pixels[1].azimuth_deg, std::nullopt);
}

TEST(SceneJson, SaysWhatCannotBeRead) {
  const auto error_of = [](const std::string& json) {
    return test::error_text([&] { scene_from_json(json); });
  };
  const std::string begin =
      R"({"schema":"splid.scene","v":[1,0],"timestamp":0,"sequence":0,"start_ps":"0","duration_ms":5,)";
  EXPECT_EQ(error_of("x"), "scene message: not a JSON object");
  EXPECT_EQ(error_of(R"({"schema":"splid.frame"})"), "scene message: /schema is not splid.scene");
  EXPECT_EQ(error_of(begin + R"("pixel":["a"]})"), "scene message: /status is missing");
  EXPECT_EQ(error_of(begin + R"("pixel":["a"],"status":["ok","ok"]})"),
            "scene message: /status is not an array of 1");
  EXPECT_EQ(error_of(begin + R"("pixel":["a"],"status":["ok"],"distance_m":["x"]})"),
            "scene message: /distance_m/0 is not a number");
  EXPECT_EQ(error_of(begin + R"("pixel":["a"],"status":["fine"]})"),
            "scene message: /status/0 has the unknown value fine");
}

}  // namespace
}  // namespace splid
