#include "drivers/replay/recording_info.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/made_recording.hpp"
#include "tests/support/real_recording.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

using test::counted;
using test::marker_record;
using test::overflow_record;
using test::photon_record;
using test::recording;
using test::sync_record;

TEST(RecordingInfo, CountsKindsAndChannels) {
  const test::TempFolder folder;
  PtuFacts facts = counted(0);
  facts.origin_ps = 1'000'000'000'000;
  const std::string file = folder.write(
      "made.ptu",
      recording(facts, {photon_record(0, 100), photon_record(2, 200), sync_record(90),
                        marker_record(3, 300), photon_record(2, 400), (1U << 31U) | (20U << 25U),
                        overflow_record(1), sync_record(5)}));
  const RecordingInfo info = scan_recording(file);
  EXPECT_EQ(info.records, 8U);
  EXPECT_EQ(info.overflow_records, 1U);
  EXPECT_EQ(info.unknown_records, 1U);
  EXPECT_EQ(info.photons[0], 1U);
  EXPECT_EQ(info.photons[2], 2U);
  EXPECT_EQ(info.syncs, 2U);
  EXPECT_EQ(info.markers[3], 1U);
  EXPECT_EQ(info.tags(), 6U);
  EXPECT_EQ(info.first_ps, 1'000'000'000'090);
  EXPECT_EQ(info.last_ps, 1'000'033'554'437);
  EXPECT_EQ(info.steps_back, 1U);
  EXPECT_EQ(info.far_steps_back, 0U);
  EXPECT_EQ(info.longest_step_back_ps, 110);
  EXPECT_TRUE(info.whole);
  EXPECT_EQ(info.warnings.size(), 1U);
  EXPECT_EQ(channels_in_words(info), "input 0, input 2, sync and marker:3");
}

TEST(RecordingInfo, StepsBackAreCounted) {
  const test::TempFolder folder;
  const RecordingInfo info = scan_recording(folder.write(
      "made.ptu", recording(counted(5), {photon_record(1, 3'000'000), photon_record(1, 2'000'000),
                                         photon_record(1, 1'999'999), photon_record(1, 2'000'000),
                                         photon_record(1, 900'000)})));
  EXPECT_EQ(info.steps_back, 3U);
  EXPECT_EQ(info.far_steps_back, 1U);
  EXPECT_EQ(info.longest_step_back_ps, 1'100'000);
}

TEST(RecordingInfo, NothingInItIsSaid) {
  const test::TempFolder folder;
  const RecordingInfo info = scan_recording(folder.write("made.ptu", recording(counted(0), {})));
  EXPECT_FALSE(info.first_ps);
  EXPECT_EQ(channels_in_words(info), "no tags");
}

TEST(RecordingInfo, EndsAtMaxTags) {
  const test::TempFolder folder;
  std::string content = recording(counted(200'000), {});
  for (int i = 0; i < 200'000; ++i) content.append({1, 0, 0, 2});
  const RecordingInfo info = scan_recording(folder.write("made.ptu", content), 1000);
  EXPECT_FALSE(info.whole);
  EXPECT_GE(info.tags(), 1000U);
  EXPECT_LT(info.tags(), 200'000U);
}

TEST(RecordingInfo, OfARealHydraHarp) {
  const std::filesystem::path file = test::real_recording_path("hydraharp400_t2_hbt.ptu");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there: see SPLID_DATA";
  const RecordingInfo info = scan_recording(file.string());
  EXPECT_EQ(info.records, 409'482U);
  EXPECT_EQ(info.overflow_records, 25'463U);
  EXPECT_EQ(info.photons[0], 159'298U);
  EXPECT_EQ(info.photons[1], 224'721U);
  EXPECT_EQ(info.first_ps, 8'584'904);
  EXPECT_EQ(info.last_ps, 999'986'166'686);
  EXPECT_EQ(channels_in_words(info), "input 0 and input 1");
  EXPECT_THAT(info.warnings, ::testing::IsEmpty());
}

TEST(RecordingInfo, OfARealQuTag) {
  const std::filesystem::path file = test::real_recording_path("qutag_sync_t2.ptu");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there: see SPLID_DATA";
  const RecordingInfo info = scan_recording(file.string());
  EXPECT_EQ(info.photons[1], 43'736U);
  EXPECT_EQ(info.photons[2], 62'437U);
  EXPECT_EQ(info.syncs, 105'600U);
  EXPECT_EQ(channels_in_words(info), "input 1, input 2 and sync");
}

}  // namespace
}  // namespace splid
