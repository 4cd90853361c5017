#include "drivers/replay/recording_info.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/made_recording.hpp"
#include "tests/support/other_recordings.hpp"
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
  EXPECT_EQ(info.photons.at(0), 1U);
  EXPECT_EQ(info.photons.at(2), 2U);
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

TEST(RecordingInfo, LossesOfTheHeaderAreSummedUp) {
  const test::TempFolder folder;
  PtuFacts facts = counted(1);
  facts.losses = {{500, 900, 7}, {2'000, 2'000, 5}, {3'000, 3'700, -1}};
  const LossSummary losses =
      scan_recording(folder.write("made.ptu", recording(facts, {photon_record(1, 5)}))).losses;
  EXPECT_EQ(losses.count, 3U);
  EXPECT_EQ(losses.known_tags, 12U);
  EXPECT_EQ(losses.uncounted, 1U);
  EXPECT_EQ(losses.first_ps, 500);
  EXPECT_EQ(losses.last_ps, 3'000);
  EXPECT_EQ(losses.longest_ps, 700);
}

TEST(RecordingInfo, LossesThatRecordsTellOfAreSummedUp) {
  const test::TempFolder folder;
  folder.write("a.set", std::string(test::spc_settings));
  const auto losses_of = [&](const std::vector<std::uint32_t>& records) {
    return scan_recording(folder.write("a.spc", test::spc_recording(100, records))).losses;
  };
  using test::spc_gap;
  using test::spc_photon;
  // The second photon has no time, and is not lost.
  const LossSummary none =
      losses_of({spc_photon(3, 4095, 2), test::spc_invalid | spc_photon(4, 1, 2)});
  EXPECT_EQ(none.count, 0U);
  EXPECT_FALSE(none.first_ps);
  const LossSummary two = losses_of({spc_photon(3, 4095, 2), spc_gap | spc_photon(9, 4095, 2),
                                     spc_photon(20, 4095, 1), spc_gap | spc_photon(22, 4095, 2)});
  EXPECT_EQ(two.count, 2U);
  EXPECT_EQ(two.known_tags, 0U);
  EXPECT_EQ(two.uncounted, 2U);
  EXPECT_EQ(two.first_ps, 30'000);
  EXPECT_EQ(two.last_ps, 200'000);
  EXPECT_EQ(two.longest_ps, 60'000);
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
  EXPECT_EQ(info.photons.at(0), 159'298U);
  EXPECT_EQ(info.photons.at(1), 224'721U);
  EXPECT_EQ(info.first_ps, 8'584'904);
  EXPECT_EQ(info.last_ps, 999'986'166'686);
  EXPECT_EQ(channels_in_words(info), "input 0 and input 1");
  EXPECT_THAT(info.warnings, ::testing::IsEmpty());
}

TEST(RecordingInfo, OfARealQuTag) {
  const std::filesystem::path file = test::real_recording_path("qutag_sync_t2.ptu");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there: see SPLID_DATA";
  const RecordingInfo info = scan_recording(file.string());
  EXPECT_EQ(info.photons.at(1), 43'736U);
  EXPECT_EQ(info.photons.at(2), 62'437U);
  EXPECT_EQ(info.syncs, 105'600U);
  EXPECT_EQ(channels_in_words(info), "input 1, input 2 and sync");
}

}  // namespace
}  // namespace splid
