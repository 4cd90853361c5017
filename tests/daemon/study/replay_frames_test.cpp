#include "daemon/study/replay_frames.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "daemon/stream/open_source.hpp"
#include "drivers/replay/replay.hpp"
#include "protocol/error.hpp"
#include "protocol/json_value.hpp"
#include "tests/support/field_scene.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

const std::string golden_interleaved = SPLID_SOURCE_DIR "/tests/data/golden/interleaved";

Config golden_config() {
  Config config = load_config(golden_interleaved + ".json");
  read_from(golden_interleaved + ".ptu", "", 0, config);
  return config;
}

std::vector<FrameMessage> frames_until(const Config& config, std::size_t most) {
  std::vector<FrameMessage> frames;
  measure_frames(
      config, open_source(config),
      [&frames](const FrameMessage& message) { frames.push_back(message); },
      [&frames, most] { return frames.size() < most; });
  return frames;
}

// That they are those of `splid replay` to the bit is tried in Python, where the module stands
// beside the program.
TEST(ReplayFrames, AreThoseThatAReplayPublished) {
  const std::vector<FrameMessage> frames = frames_until(golden_config(), 1000);
  std::ifstream lines(golden_interleaved + ".frames");
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    ASSERT_LT(count, frames.size());
    const nlohmann::json expected = json_value(line);
    EXPECT_EQ(frames[count].sequence, expected["sequence"].get<std::uint64_t>());
    EXPECT_EQ(std::to_string(frames[count].start_ps), expected["start_ps"].get<std::string>());
    EXPECT_EQ(std::string(to_string(frames[count].status)), expected["status"].get<std::string>());
    if (!expected.contains("distance_m")) continue;
    EXPECT_NEAR(frames[count].distance_m.value_or(0), expected["distance_m"].get<double>(), 1e-7);
    EXPECT_NEAR(frames[count].timestamp_s, expected["timestamp"].get<double>(), 1e-9);
  }
  EXPECT_EQ(frames.size(), count);
  EXPECT_GE(count, 6U);
}

TEST(ReplayFrames, AreTheSameWhereOthersAreNotEstimated) {
  const Config config = golden_config();
  const std::vector<FrameMessage> all = frames_until(config, 1000);
  std::vector<FrameMessage> some;
  measure_frames(
      config, open_source(config),
      [&some](const FrameMessage& message) { some.push_back(message); }, [] { return true; },
      [](const Frame& frame) { return frame.sequence % 3 == 2; });
  ASSERT_EQ(some.size(), all.size() / 3);
  for (std::size_t i = 0; i < some.size(); ++i) {
    const FrameMessage& whole = all.at(3 * i + 2);
    EXPECT_EQ(some[i].sequence, whole.sequence);
    EXPECT_EQ(some[i].start_ps, whole.start_ps);
    ASSERT_TRUE(some[i].distance_m.has_value());
    EXPECT_EQ(some[i].distance_m, whole.distance_m);
    EXPECT_EQ(some[i].std_velocity_mps, whole.std_velocity_mps);
  }
}

TEST(ReplayFrames, OfSeveralPixelsComeOneAfterTheOther) {
  constexpr std::size_t pixels = 3;
  const Config config = test::with_pixels(golden_config(), test::pixels_of(pixels));
  std::vector<FrameMessage> frames;
  measure_frames(
      config, test::script(test::field_tags(pixels, 0.12, config.pattern)),
      [&frames](const FrameMessage& message) { frames.push_back(message); }, [] { return true; });
  ASSERT_GE(frames.size(), 2 * pixels);
  for (std::size_t i = 0; i < 2 * pixels; ++i) {
    const std::size_t pixel = i % pixels;
    EXPECT_EQ(frames[i].pixel, std::to_string(pixel + 1));
    EXPECT_EQ(frames[i].sequence, i / pixels);
    EXPECT_EQ(frames[i].status, FrameStatus::ok);
    EXPECT_NEAR(frames[i].distance_m.value_or(0), 30 + 3 * static_cast<double>(pixel), 0.3);
  }
}

TEST(ReplayFrames, EndWhenTheyAreAskedTo) {
  Config config = golden_config();
  auto slow = std::make_unique<ReplayOptions>();
  slow->recording = golden_interleaved + ".ptu";
  slow->speed = 0.001;  // two minutes
  config.source = std::move(slow);
  int asked = 0;
  measure_frames(
      config, open_source(config), [](const FrameMessage&) {}, [&asked] { return ++asked < 3; });
  EXPECT_GE(asked, 3);
}

TEST(ReplayFrames, OfAnotherPatternSayWhatTheSyncsAre) {
  Config config = golden_config();
  config.pattern.segments.front().period_ps *= 1.05;
  try {
    frames_until(config, 1000);
    FAIL() << "nothing was thrown";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::data);
    EXPECT_THAT(error.what(), ::testing::HasSubstr("pattern"));
  }
}

TEST(ReplayFrames, TakeTheCountsBesideARecordingUnlessOthersAreNamed) {
  const test::TempFolder folder;
  const std::string recording = folder.path("a.ptu");
  Config config = load_config(golden_interleaved + ".json");
  config.encoder.file = "configured";
  read_from(recording, "", 0, config);
  EXPECT_EQ(config.encoder.file, "configured");
  std::ofstream(recording + ".encoder.csv") << "0,1,2\n";
  read_from(recording, "named", 0, config);
  EXPECT_EQ(config.encoder.file, "named");
  read_from(recording, "", 0, config);
  EXPECT_EQ(config.encoder.file, recording + ".encoder.csv");
}

}  // namespace
}  // namespace splid
