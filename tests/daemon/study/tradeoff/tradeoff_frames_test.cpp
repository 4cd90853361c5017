#include "daemon/study/tradeoff/tradeoff_frames.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "daemon/recording/record_source.hpp"
#include "drivers/replay/replay.hpp"
#include "protocol/error.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::tradeoff {
namespace {

using ::testing::AllOf;
using ::testing::DoubleEq;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

simulator::Options& scene_of(Config& config) {
  return dynamic_cast<simulator::Options&>(*config.source);
}

std::vector<KeptFrame> collected(const Config& config, const FrameOrigin& origin, double length_ms,
                                 std::size_t count) {
  return collect_frames(config, origin, length_ms, count, [](std::size_t) {}, {});
}

std::vector<double> lengths(const Config& config, std::vector<double> asked_ms,
                            std::vector<std::string>* warnings = nullptr) {
  return possible_lengths_ms(config, find_origin(config, ""), std::move(asked_ms),
                             [&](const std::string& sentence) {
                               if (warnings != nullptr) warnings->push_back(sentence);
                             });
}

TEST(TradeoffFrames, AreThoseOfTheConfiguredSceneOneAfterTheOther) {
  Config config = scene_config(0.01);  // the stream's own length does not matter
  scene_of(config).start_ps = 1'000'000'000'000;
  const FrameOrigin origin = find_origin(config, "");
  ASSERT_TRUE(origin.scene);
  const std::vector<KeptFrame> frames = collected(config, origin, 10, 8);
  ASSERT_EQ(frames.size(), 9u);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    EXPECT_EQ(frames[k].first, k == 0);
    EXPECT_NEAR(frames[k].length_ns(), 1e7, 4000);
    EXPECT_NEAR(static_cast<double>(frames[k].photons_ps.size()), 1893, 5 * 44);
    EXPECT_TRUE(frames[k].sync.locked);
    ASSERT_TRUE(frames[k].truth);
    EXPECT_NEAR(frames[k].truth->delay_ns, 1898, 1);
    if (k > 0) {
      EXPECT_EQ(frames[k].start_ps, frames[k - 1].end_ps);
    }
  }
}

// Photons come d later than without electronics, and show where the target was d / 2 before.
TEST(TradeoffFrames, TheTruthHoldsTheElectronics) {
  Config config = scene_config(1);
  simulator::Options& scene = scene_of(config);
  scene.target.motion = simulator::MotionKind::linear;
  scene.target.distance_m = 10;
  scene.target.velocity_mps = 140;
  scene.detection.electronic_delay_ns = 1855;
  const auto frames = collected(config, find_origin(config, ""), 10, 3);
  ASSERT_EQ(frames.size(), 4u);
  const double time_s = static_cast<double>(frames[2].middle_ps()) * 1e-12;
  const double distance_m = 10 + 140 * (time_s - 1855e-9 / 2);
  EXPECT_NEAR(frames[2].truth->delay_ns, 2 * distance_m / 0.299792458 + 1855, 1e-6);
  EXPECT_NEAR(frames[2].truth->velocity_mps, 140, 1e-9);
}

// 14 m at 140 m/s: 0.1 s, of which 0.09 s are used: 8 frames of 10 ms, 7 of them judged.
TEST(TradeoffFrames, ATargetThatComesIsWatchedAgainWithAnotherSeed) {
  Config config = scene_config(1);
  simulator::Options& scene = scene_of(config);
  scene.target.motion = simulator::MotionKind::linear;
  scene.target.distance_m = 14;
  scene.target.velocity_mps = -140;
  const auto frames = collected(config, find_origin(config, ""), 10, 20);
  std::size_t firsts = 0;
  std::set<std::vector<std::int64_t>> different;
  for (const KeptFrame& frame : frames) {
    firsts += frame.first ? 1 : 0;
    different.insert(frame.photons_ps);
    EXPECT_GT(frame.truth->delay_ns, 0);
  }
  EXPECT_EQ(frames.size() - firsts, 20u);
  EXPECT_EQ(firsts, 3u);
  EXPECT_EQ(different.size(), frames.size());
}

TEST(TradeoffFrames, OfARecordingHaveTheTruthBesideIt) {
  const splid::test::TempFolder folder;
  Config config = scene_config(0.2);
  const std::string file = folder.path("a.ptu");
  scene_of(config).truth = folder.path("a.truth.json");
  recording::record_source(config, *open_scene(config), file, false, host_clock(), {});
  const FrameOrigin origin = find_origin(config, file);
  EXPECT_FALSE(origin.scene);
  const auto frames = collected(config, origin, 10, 100);
  ASSERT_GE(frames.size(), 18u);
  ASSERT_LE(frames.size(), 20u);
  for (const KeptFrame& frame : frames) {
    ASSERT_TRUE(frame.truth);
    EXPECT_NEAR(frame.truth->delay_ns, 1898, 2);
  }
  std::filesystem::remove(scene_of(config).truth);
  for (const KeptFrame& frame : collected(config, find_origin(config, file), 10, 100)) {
    EXPECT_FALSE(frame.truth);
  }
  folder.write("a.truth.json", "{}");
  EXPECT_THAT(splid::test::error_text([&] { find_origin(config, file); }),
              HasSubstr("a.truth.json"));
  // A configured replay is a recording too.
  std::filesystem::remove(folder.path("a.truth.json"));
  auto replay = std::make_unique<ReplayOptions>();
  replay->recording = file;
  config.source = std::move(replay);
  EXPECT_EQ(find_origin(config, "").recording, file);
}

TEST(TradeoffFrames, ARecordingOfAnotherPatternIsADataError) {
  const splid::test::TempFolder folder;
  Config config = scene_config(0.2);
  const std::string file = folder.path("a.ptu");
  recording::record_source(config, *open_scene(config), file, false, host_clock(), {});
  config.pattern.segments.front().period_ps = 3'770'000;
  const FrameOrigin origin = find_origin(config, file);
  EXPECT_THAT(splid::test::error_text([&] { collected(config, origin, 10, 20); }),
              AllOf(HasSubstr(file), HasSubstr("3780")));
}

TEST(TradeoffFrames, LengthsAreAroundTheConfiguredOneUnlessAskedFor) {
  const Config config = scene_config(1);
  EXPECT_THAT(lengths(config, {}),
              ElementsAre(DoubleEq(5), DoubleEq(20), DoubleEq(50), DoubleEq(200)));
  EXPECT_THAT(lengths(config, {50, 10, 50}), ElementsAre(10, 50));
}

TEST(TradeoffFrames, LengthsThatCannotBeAreLeftOutWithAReason) {
  Config config = scene_config(1);
  config.pipeline.ring_capacity_tags = 1 << 14;
  std::vector<std::string> warnings;
  EXPECT_THAT(lengths(config, {10, 50, 100}, &warnings), ElementsAre(10, 50));
  EXPECT_THAT(warnings, ElementsAre(AllOf(HasSubstr("100 ms"), HasSubstr("ring"))));
  warnings.clear();
  simulator::Options& scene = scene_of(config);
  scene.target.motion = simulator::MotionKind::linear;
  scene.target.distance_m = 14;
  scene.target.velocity_mps = -140;
  EXPECT_THAT(lengths(config, {10, 50}, &warnings), ElementsAre(10));
  EXPECT_THAT(warnings, ElementsAre(AllOf(HasSubstr("50 ms"), HasSubstr("arrives"))));
  EXPECT_THAT(splid::test::error_text([&] { lengths(config, {100}); }),
              HasSubstr("no frame length can be measured"));
}

TEST(TradeoffFrames, ALengthIsAWholeNumberOfPeriods) {
  Config config = scene_config(1);
  config.pattern.segments.front().period_ps = 8e9;
  config.pattern.unambiguous_delay_ps = 8e9;
  EXPECT_THAT(lengths(config, {2, 8, 11, 50}), ElementsAre(8, 50));
}

}  // namespace
}  // namespace splid::tradeoff
