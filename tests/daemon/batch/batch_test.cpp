#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "daemon/batch/measure_part.hpp"
#include "daemon/batch/merge_slices.hpp"
#include "daemon/recording/ptu_writer.hpp"
#include "daemon/stream/device_clock.hpp"
#include "daemon/stream/open_source.hpp"
#include "daemon/study/replay_frames.hpp"
#include "protocol/error.hpp"
#include "protocol/frame_columns.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/field_scene.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temp_folder.hpp"

// Recordings in slices of three frames, by several shards, against a whole replay.

namespace splid::batch {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

const std::string golden_folder = SPLID_SOURCE_DIR "/tests/data/golden/";
constexpr Slicing few_frames{3};
constexpr auto hear_nothing = [](std::uint64_t) {};

class Batch : public ::testing::TestWithParam<const char*> {
 protected:
  static Config config(const std::string& mode, bool tracked = false, std::int64_t threads = 1) {
    Config made = load_config(golden_folder + mode + ".json");
    made.estimator.tracked = tracked;
    made.pipeline.estimation_threads = threads;
    made.pipeline.ring_capacity_tags = 1 << 16;
    return made;
  }

  // The rows of a whole replay, without the times that it took.
  static std::string rows_of_replay(Config config, const std::string& recording) {
    read_from(recording, "", 0, config);
    std::string rows;
    const auto take = [&rows](FrameMessage message) {
      message.compute_ms.reset();
      message.latency_ms.reset();
      append_frame_row(message, rows);
    };
    measure_frames(config, open_source(config), take, [] { return true; });
    return rows;
  }

  static void measure(const std::vector<std::string>& files, Meter& meter, const Shard& shard,
                      const Folder& folder) {
    const auto recordings = find_recordings(files);
    folder.begin(meter.facts(), recordings);
    for (const Recording& recording : recordings) {
      const Part part = part_of(shard, recording, bytes_of(recordings));
      EXPECT_TRUE(meter.measure(recording, part, folder, hear_nothing, {}));
    }
  }

  // What a batch of `count` shards writes: each table and the summary, by name.
  static std::map<std::string, std::string> batch(const std::vector<std::string>& files,
                                                  const std::function<Config()>& made,
                                                  std::uint64_t count, std::int64_t jobs) {
    const test::TempFolder output;
    const Folder folder(output.path("out"));
    for (std::uint64_t index = count; index >= 1; --index) {
      Meter meter(made(), jobs, few_frames);
      measure(files, meter, {index, count}, folder);
    }
    std::map<std::string, std::string> written;
    for (const Outcome& outcome : merge_folder(folder)) {
      EXPECT_EQ(outcome.state, State::done) << outcome.why;
      written[outcome.recording.name] = test::file_text(folder.table_file(outcome.recording));
    }
    written["summary"] = test::file_text(folder.summary_file());
    return written;
  }
};

TEST_P(Batch, HasTheSameBitsForAnyShardsAndJobsAndForAWholeReplay) {
  const std::string mode = GetParam();
  const std::vector<std::string> files = {golden_folder + mode + ".ptu"};
  const auto made = [&mode] { return config(mode); };
  const auto whole = batch(files, made, 1, 1);
  const std::string rows = rows_of_replay(made(), files[0]);
  ASSERT_GE(rows.size(), 6 * frame_row_bytes());
  EXPECT_TRUE(whole.at(mode).ends_with(rows));
  for (const std::uint64_t count : {1U, 2U, 7U}) {
    for (const std::int64_t jobs : {1, 2}) {
      EXPECT_EQ(batch(files, made, count, jobs), whole) << count << " shards, " << jobs << " jobs";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, Batch, ::testing::Values("interleaved", "random", "mrr"),
                         [](const auto& mode) { return std::string(mode.param); });

class BatchOfGolden : public Batch {};

// A tracked frame depends on the estimates before it, in as many threads as are configured.
TEST_F(BatchOfGolden, TrackedFramesAreThoseOfAReplayToo) {
  const std::vector<std::string> files = {golden_folder + "interleaved.ptu"};
  const auto made = [] { return config("interleaved", true, 2); };
  const auto whole = batch(files, made, 1, 1);
  EXPECT_TRUE(whole.at("interleaved").ends_with(rows_of_replay(made(), files[0])));
  EXPECT_EQ(batch(files, made, 2, 2), whole);
  EXPECT_EQ(batch(files, made, 7, 3), whole);
}

// Each frame has a row for each pixel, and the summary a line.
TEST_F(BatchOfGolden, PixelsAreThoseOfAReplayToo) {
  const std::vector<std::string> files = {golden_folder + "interleaved.ptu"};
  const auto made = [] {
    return test::with_pixels(config("interleaved", false, 2), test::pixels_of(3));
  };
  const auto whole = batch(files, made, 1, 1);
  const std::string rows = rows_of_replay(made(), files[0]);
  ASSERT_EQ(rows.size(), 3 * 7 * frame_row_bytes());
  EXPECT_TRUE(whole.at("interleaved").ends_with(rows));
  EXPECT_THAT(whole.at("summary"), MatchesRegex("[^\n]*,pixel,why\n"
                                                "[^\n]*,done,7,6,6,0,0,1,[^\n]*,1,\"\"\n"
                                                "[^\n]*,done,7,0,0,6,0,1,[^\n]*,2,\"\"\n"
                                                "[^\n]*,done,7,0,0,6,0,1,[^\n]*,3,\"\"\n"));
  EXPECT_EQ(batch(files, made, 2, 2), whole);
  EXPECT_EQ(batch(files, made, 7, 1), whole);
}

TEST_F(BatchOfGolden, SeveralRecordingsGiveATableEach) {
  const test::TempFolder inputs;
  for (const char* name : {"x/a.ptu", "x/b.ptu", "y/a.ptu"}) {
    inputs.write(name, test::file_text(golden_folder + "interleaved.ptu"));
  }
  const auto made = [] { return config("interleaved"); };
  const auto whole = batch({inputs.path("")}, made, 1, 1);
  EXPECT_EQ(whole.size(), 4U);
  EXPECT_EQ(batch({inputs.path("")}, made, 7, 1), whole);
  EXPECT_EQ(std::count(whole.at("summary").begin(), whole.at("summary").end(), '\n'), 4);
}

TEST_F(BatchOfGolden, KeepsTheSlicesThatAreMeasured) {
  const test::TempFolder output;
  const Folder folder(output.path("out"));
  const std::vector<std::string> files = {golden_folder + "interleaved.ptu"};
  const Recording recording = find_recordings(files).front();
  Meter meter(config("interleaved"), 1, few_frames);
  measure(files, meter, {}, folder);
  const std::string key = Folder::key_of(meter.facts(), recording);
  // As if it had been killed after the first slice, whose frames are made to be told from others.
  std::string marked = folder.slice_rows(recording, folder.slices(recording, key).front());
  marked[frame_row_bytes() - 1] ^= 1;
  folder.remove_slices(recording);
  folder.write_slice(recording, key, {0, few_frames.frames}, marked);
  measure(files, meter, {}, folder);
  EXPECT_EQ(merge_folder(folder).front().state, State::done);
  const std::string table = test::file_text(folder.table_file(recording));
  EXPECT_NE(table.find(marked), std::string::npos);
}

TEST_F(BatchOfGolden, AStopKeepsWholeSlicesAndGoesOnLater) {
  const std::vector<std::string> files = {golden_folder + "interleaved.ptu"};
  const auto made = [] { return config("interleaved"); };
  const test::TempFolder output;
  const Folder folder(output.path("out"));
  const auto recordings = find_recordings(files);
  Meter meter(made(), 1, few_frames);
  folder.begin(meter.facts(), recordings);
  const std::string key = Folder::key_of(meter.facts(), recordings[0]);
  std::stop_source stop;
  const auto stop_after_a_slice = [&](std::uint64_t) {
    if (!folder.slices(recordings[0], key).empty()) stop.request_stop();
  };
  const Part all{0, recordings[0].bytes};
  const bool ended =
      meter.measure(recordings[0], all, folder, stop_after_a_slice, stop.get_token());
  EXPECT_FALSE(ended);
  for (const SliceHead& slice : folder.slices(recordings[0], key)) EXPECT_EQ(slice.frames, 3U);
  EXPECT_EQ(merge_slices(folder, recordings[0]).state, State::unfinished);
  EXPECT_TRUE(meter.measure(recordings[0], all, folder, hear_nothing, {}));
  ASSERT_EQ(merge_folder(folder).front().state, State::done);
  EXPECT_EQ(test::file_text(folder.table_file(recordings[0])),
            batch(files, made, 1, 1).at("interleaved"));
}

TEST_F(BatchOfGolden, AnUnfinishedRecordingSaysWhatIsMissing) {
  const test::TempFolder output;
  const Folder folder(output.path("out"));
  const std::vector<std::string> files = {golden_folder + "interleaved.ptu"};
  Meter meter(config("interleaved"), 1, few_frames);
  measure(files, meter, {1, 7}, folder);
  const Outcome part = merge_folder(folder).front();
  EXPECT_EQ(part.state, State::unfinished);
  EXPECT_THAT(part.why, HasSubstr("interleaved.ptu: what follows frame "));
  for (std::uint64_t index = 2; index <= 7; ++index) measure(files, meter, {index, 7}, folder);
  EXPECT_EQ(merge_folder(folder).front().state, State::done);
  // Once it is done, it stays so, and needs no measuring.
  EXPECT_EQ(merge_folder(folder).front().state, State::done);
  const Recording recording = find_recordings(files).front();
  EXPECT_TRUE(meter.is_measured(recording, {0, recording.bytes}, folder));
  std::filesystem::remove(folder.table_file(recording));
  EXPECT_FALSE(meter.is_measured(recording, {0, recording.bytes}, folder));
}

// Frames of an array that take longer than a stop's patience are on their way when the shard sees
// that its part is over.
TEST_F(BatchOfGolden, AShardWaitsForItsLastFrames) {
  constexpr std::size_t pixels = 8;
  const auto made = [] {
    Config slow = test::with_pixels(config("interleaved"), test::pixels_of(pixels));
    slow.scene.max_speed_mps = 10'000;
    slow.scene.targets = 4;
    slow.scene.motion = Motion::accelerating;
    slow.scene.max_acceleration_mps2 = 1e5;
    return slow;
  };
  const test::TempFolder inputs;
  const std::string file = inputs.path("slow.ptu");
  const DeviceClock clock{SourceInfo{"made", false, 1.6e9}, host_clock()};
  recording::PtuWriter writer(file, {}, clock, true);
  writer.write(test::field_tags(pixels, 0.05, made().pattern));  // two frames and a half
  writer.close();
  const Folder folder(inputs.path("out"));
  Meter meter(made(), 1, Slicing{1});
  measure({file}, meter, {1, 2}, folder);
  const Recording recording = find_recordings({file}).front();
  const auto slices = folder.slices(recording, Folder::key_of(meter.facts(), recording));
  ASSERT_EQ(slices.size(), 2U);
  std::string rows;
  for (const SliceHead& slice : slices) rows += folder.slice_rows(recording, slice);
  ASSERT_EQ(rows.size(), 2 * pixels * frame_row_bytes());
  EXPECT_TRUE(rows_of_replay(made(), file).starts_with(rows));
}

TEST_F(BatchOfGolden, ARecordingWithoutTagsHasATableWithoutFrames) {
  const test::TempFolder inputs;
  const DeviceClock clock{SourceInfo{"made", false, 1.6e9}, host_clock()};
  recording::PtuWriter(inputs.path("empty.ptu"), {}, clock, true).close();
  const auto made = [] { return config("interleaved"); };
  const auto whole = batch({inputs.path("empty.ptu")}, made, 1, 1);
  EXPECT_THAT(whole.at("summary"), HasSubstr("\"empty.h5\",done,0,0,"));
  EXPECT_EQ(batch({inputs.path("empty.ptu")}, made, 7, 1), whole);
}

TEST_F(BatchOfGolden, OneThatCannotLockFails) {
  const test::TempFolder output;
  Config other = config("interleaved");
  other.pattern.segments.front().period_ps *= 1.05;
  Meter meter(std::move(other), 1, few_frames);
  const Folder folder(output.path("out"));
  const std::string why =
      test::error_text([&] { measure({golden_folder + "interleaved.ptu"}, meter, {}, folder); });
  EXPECT_THAT(why, HasSubstr("period"));
  EXPECT_EQ(merge_folder(folder).front().state, State::unfinished);
}

}  // namespace
}  // namespace splid::batch
