#include "daemon/recording/recording_tap.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "drivers/replay/recording_info.hpp"
#include "drivers/replay/replay.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/held_clock.hpp"
#include "tests/support/measured_stream.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/read_back.hpp"
#include "tests/support/scripted_source.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/vector_sink.hpp"

namespace splid::recording {
namespace {

using splid::test::read_back;
using splid::test::recordings_in;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;

bool on_framer() {
  std::array<char, 16> name{};
  pthread_getname_np(pthread_self(), name.data(), name.size());
  return std::string_view(name.data()) == "framer";
}

void say_nothing(const std::string&) {}

// A disk that takes nothing until it is let go: the recorder looks at its clock between two writes.
class FrozenClock final : public Clock {
 public:
  [[nodiscard]] double unix_s() const override { return 1.7e9; }
  [[nodiscard]] std::int64_t steady_ns() const override {
    frozen.wait(true);
    return host_clock().steady_ns();
  }
  void thaw() {
    frozen = false;
    frozen.notify_all();
  }
  std::atomic<bool> frozen{true};
};

std::vector<Tag> photons(std::int64_t count) {
  std::vector<Tag> tags;
  for (std::int64_t i = 0; i < count; ++i) tags.push_back(photon_tag(1'000'000 * i, 1));
  return tags;
}

struct Measured {
  std::vector<std::string> json;
  FramerTotals tags;
  std::uint64_t allocations = 0;
  std::string recorded;
};

// Frames of a source, recorded where config says so. Allocations of the framer's thread are counted
// from the second frame on.
Measured measure(const Config& config, std::unique_ptr<TagSource> source) {
  const SourceInfo info = source->info();
  Publisher publisher(config.publish.endpoint, 1000);
  test::MeasuredStream stream(config, std::move(source), publisher, host_clock());
  std::optional<Tap> recording;
  if (!config.record.folder.empty()) {
    recording.emplace(config, info, host_clock(), say_nothing);
    stream.record(&*recording);
  }
  Measured measured;
  stream.observe([&](const FrameMessage& frame, const std::string& json) {
    if (frame.sequence == 1) test::counted_thread = on_framer;
    measured.json.push_back(repeatable(json));
    return true;
  });
  measured.tags = stream.run({}).tags;
  measured.allocations = test::allocations;
  test::counted_thread = nullptr;
  if (recording) measured.recorded = recording->summary();
  return measured;
}

TEST(RecordingTap, ItsFilesGiveTheSameFramesAgain) {
  const splid::test::TempFolder folder;
  Config config = scene_config(1.2);
  const Measured plain = measure(config, open_scene(config));
  config.record.folder = folder.path("r");
  config.record.max_file_s = 0.5;
  test::counted_thread = [] { return false; };
  test::allocations = 0;
  const Measured live = measure(config, open_scene(config));
  EXPECT_EQ(live.allocations, 0u);
  EXPECT_THAT(live.json, ElementsAreArray(plain.json));
  EXPECT_THAT(live.recorded, HasSubstr("3 recordings; 0 tags lost"));
  std::vector<Tag> tags;
  std::vector<Tag> first;
  for (const std::string& file : recordings_in(folder.path("r"))) {
    const std::vector<Tag> part = read_back(file);
    tags.insert(tags.end(), part.begin(), part.end());
    if (first.empty()) first = part;
  }
  EXPECT_EQ(tags.size(), live.tags.events);
  config.record.folder.clear();
  const SourceInfo info = open_scene(config)->info();
  const Measured again = measure(config, std::make_unique<ScriptedSource>(tags, info));
  // The last frame knows from the stream how far the scene went on in the dark.
  ASSERT_GE(again.json.size(), 23u);
  for (std::size_t i = 0; i < 23; ++i) EXPECT_EQ(again.json[i], live.json[i]) << i;
  // Those that lie whole in the first file, from it alone.
  const Measured alone = measure(config, std::make_unique<ScriptedSource>(first, info));
  ASSERT_GE(alone.json.size(), 9u);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_EQ(alone.json[i], live.json[i]) << i;
}

// The framer loses the same tag, and finds it among the recording's losses again, as one without an
// interval, which costs its frame 1 ps.
TEST(RecordingTap, AStrayTimeGivesTheSameFramesAgain) {
  const splid::test::TempFolder folder;
  Config config = scene_config(1.2);
  config.record.folder = folder.path("r");
  (void)measure(config, open_scene(config));
  std::vector<Tag> tags = read_back(recordings_in(folder.path("r")).at(0));
  const Tag in_the_midst = tags[tags.size() / 2];
  tags.insert(tags.begin() + static_cast<std::ptrdiff_t>(tags.size() / 2),
              photon_tag(in_the_midst.time_ps + 3'600'000'000'000'000, 1));
  config.record.folder = folder.path("s");
  const SourceInfo info{"script", false, {}};
  const Measured live = measure(config, std::make_unique<ScriptedSource>(tags, info));
  EXPECT_THAT(live.recorded,
              HasSubstr("0 tags lost to the disk; 1 tags had a time far ahead of all others"));
  ReplayOptions replay;
  replay.recording = recordings_in(folder.path("s")).at(0);
  SourceContext context;
  context.pattern = &config.pattern;
  test::VectorSink sink;
  replay.open(context)->run(sink, {});
  config.record.folder.clear();
  const Measured again = measure(config, std::make_unique<ScriptedSource>(sink.tags, info));
  EXPECT_EQ(live.tags.late, 1U);
  EXPECT_EQ(again.tags.late, 0U);
  EXPECT_EQ(again.tags.reported, 1U);
  ASSERT_EQ(again.json.size(), live.json.size());
  std::size_t differ = 0;
  for (std::size_t i = 0; i < live.json.size(); ++i) {
    if (again.json[i] == live.json[i]) continue;
    ++differ;
    const FrameMessage once = frame_from_json(live.json[i] + "}");
    const FrameMessage twice = frame_from_json(again.json[i] + "}");
    EXPECT_EQ(twice.lost_tags, once.lost_tags);
    EXPECT_NEAR(*twice.distance_m, *once.distance_m, 1e-9);
    EXPECT_NEAR(*twice.seen_fraction, *once.seen_fraction, 1e-10);
  }
  EXPECT_LE(differ, 1U);
}

TEST(RecordingTap, KeepsTagsOfEveryInputThatTheConfigurationTakes) {
  const splid::test::TempFolder folder;
  Config config = scene_config(0);
  config.record.folder = folder.path("r");
  config.channels.photon = {"-1", "0"};
  config.channels.sync = "126";
  std::vector<Tag> tags;
  for (std::int64_t i = 0; i < 300; ++i) tags.push_back(photon_tag(1'000'000 * i, 62));
  for (std::int64_t i = 0; i < 300; i += 3) {
    tags[static_cast<std::size_t>(i)].value = -1;
    tags[static_cast<std::size_t>(i) + 1].value = i % 2 == 0 ? 0 : 126;
  }
  Tap recording(config, SourceInfo{"script", false, {}}, host_clock(), say_nothing);
  recording.take(tags);
  EXPECT_THAT(recording.summary(), HasSubstr("1 recordings; 0 tags lost"));
  const std::vector<std::string> files = recordings_in(folder.path("r"));
  ASSERT_EQ(files.size(), 1u);
  EXPECT_EQ(read_back(files[0]), tags);
  EXPECT_EQ(scan_recording(files[0]).header.text("Splid_Inputs"), "59:62 60:126 61:0 62:-1");
}

TEST(RecordingTap, IsRefusedWhereTheConfigurationNamesMoreInputsThanAFileHolds) {
  const splid::test::TempFolder folder;
  Config config = scene_config(0);
  config.record.folder = folder.path("r");
  config.channels.photon.clear();
  for (int input = 1; input <= 64; ++input) config.channels.photon.push_back(std::to_string(input));
  const SourceInfo source{"script", true, {}};
  Tap(config, source, host_clock(), say_nothing).finish();
  config.channels.sync = "100";
  EXPECT_THAT(test::error_text([&] { Tap(config, source, host_clock(), say_nothing); }),
              HasSubstr("/channels: input 100 is one more than the 64"));
}

// What no record holds is counted, and no longer told as recorded.
TEST(RecordingTap, CountsWhatNoRecordHolds) {
  const splid::test::TempFolder folder;
  Config config = scene_config(0);
  config.record.folder = folder.path("r");
  config.record.max_file_s = 1;
  Tap recording(config, SourceInfo{"script", false, {}}, host_clock(), say_nothing);
  std::vector<Tag> tags;
  for (int input = 1; input <= 66; ++input) tags.push_back(photon_tag(1000, input));
  tags.push_back(photon_tag(1'500'000'000'000, 1));
  tags.push_back(photon_tag(1'500'000'000'000, 1));
  tags.push_back(photon_tag(1'600'000'000'000, 1));
  tags.push_back(photon_tag(1'700'000'000'000, 1));
  tags.push_back(photon_tag(1'550'000'000'000, 1));
  recording.take(tags);
  EXPECT_THAT(recording.summary(),
              HasSubstr("2 recordings; 0 tags lost to the disk; 3 tags fit no record"));
}

// A recorder that is slower than the tags: nobody waits, what is missing is in the files' losses.
TEST(RecordingTap, ALiveSourceNeverWaitsForIt) {
  const splid::test::TempFolder folder;
  Config config = scene_config(0);
  config.pipeline.ring_capacity_tags = 1024;
  config.record.folder = folder.path("r");
  constexpr std::int64_t count = 2'000'000;
  std::vector<Tag> tags;
  for (std::int64_t i = 0; i < count; ++i) tags.push_back(photon_tag(1000 * i, 1));
  Tap recording(config, SourceInfo{"script", true, {}}, host_clock(), say_nothing);
  recording.take(tags);
  const std::string summary = recording.summary();
  EXPECT_EQ(recording.fault(), "");
  const std::vector<std::string> files = recordings_in(folder.path("r"));
  ASSERT_EQ(files.size(), 1u);
  std::int64_t lost = 0;
  for (const Loss& loss : scan_recording(files[0]).header.losses) lost += loss.count;
  EXPECT_GT(lost, 0);
  EXPECT_EQ(static_cast<std::int64_t>(read_back(files[0]).size()) + lost, count) << summary;
}

TEST(RecordingTap, SaysWhereItsTagsGo) {
  const splid::test::TempFolder folder;
  Config config = scene_config(0);
  config.record.folder = folder.path("r");
  config.record.max_file_s = 1;
  Tap recording(config, SourceInfo{"script", false, {}}, host_clock(), say_nothing);
  EXPECT_EQ(recording.status(), RecordingStatus{});
  for (const std::int64_t second : {0, 1}) {
    const std::int64_t begin_ps = second * 1'000'000'000'000;
    recording.take(
        std::vector<Tag>{photon_tag(begin_ps, 1), photon_tag(begin_ps + 250'000'000'000, 1)});
    ASSERT_TRUE(test::eventually([&] {
      return recordings_in(folder.path("r")).size() == static_cast<std::size_t>(second) + 1 &&
             recording.status().seconds == 0.25;
    }));
    const RecordingStatus status = recording.status();
    EXPECT_EQ(status.state, RecordingState::writing);
    EXPECT_EQ(status.file, recordings_in(folder.path("r")).back());
    EXPECT_GT(status.bytes, 0u);
    recording.take(std::vector<Tag>{photon_tag(begin_ps + 500'000'000'000, 1)});
    ASSERT_TRUE(test::eventually([&] { return recording.status().seconds == 0.5; }));
    EXPECT_GT(recording.status().bytes, status.bytes);
  }
  recording.finish();
}

// What a killed daemon may lose, on a clock that the test moves: no machine is too slow for this.
TEST(RecordingTap, HandsItsTagsToTheSystemWithinHalfASecond) {
  const splid::test::TempFolder folder;
  Config config = scene_config(0);
  config.record.folder = folder.path("r");
  HeldClock clock;
  Tap recording(config, SourceInfo{"script", false, {}}, clock, say_nothing);
  for (std::int64_t half_second = 1; half_second <= 3; ++half_second) {
    const std::int64_t begin_ps = half_second * 500'000'000'000;
    recording.take(std::vector<Tag>{photon_tag(begin_ps, 1), photon_tag(begin_ps + 1000, 1),
                                    photon_tag(begin_ps + 100'000'000, 1)});
    ASSERT_TRUE(test::eventually([&] { return recording.status().seconds > 0; }));
    clock.advance_ms(500);
    // The last of three stays behind: tags of the last microsecond are still to be sorted.
    EXPECT_TRUE(test::eventually([&] {
      return read_back(recording.file()).size() >= static_cast<std::size_t>(3 * half_second) - 1;
    }));
  }
  recording.finish();
}

TEST(RecordingTap, NoticesWithinASecondThatItsFolderIsRemoved) {
  const splid::test::TempFolder folder;
  Config config = scene_config(0);
  config.record.folder = folder.path("r");
  HeldClock clock;
  Tap recording(config, SourceInfo{"script", false, {}}, clock, say_nothing);
  recording.take(std::vector<Tag>{photon_tag(0, 1), photon_tag(1'000'000'000'000, 1)});
  ASSERT_TRUE(test::eventually([&] { return recording.status().seconds == 1; }));
  std::filesystem::remove_all(folder.path("r"));
  clock.advance_ms(1000);
  EXPECT_TRUE(test::eventually([&] {
    return recording.status() == RecordingStatus{RecordingState::failing, "", 0, 0};
  }));
  EXPECT_THAT(recording.fault(), HasSubstr("was removed while it was written"));
  recording.finish();
  EXPECT_EQ(recording.summary(), "0 recordings; 2 tags lost to the disk");
}

TEST(RecordingTap, SaysThatItFails) {
  const splid::test::TempFolder folder;
  Config config = scene_config(0);
  config.record.folder = folder.write("no_folder", "");
  Tap recording(config, SourceInfo{"script", false, {}}, host_clock(), say_nothing);
  recording.take(std::vector<Tag>{photon_tag(1000, 1)});
  EXPECT_TRUE(test::eventually([&] {
    return recording.status() == RecordingStatus{RecordingState::failing, "", 0, 0};
  }));
  recording.finish();
}

TEST(RecordingTap, CountsThatNobodyTakesAreAnOverrun) {
  CountsQueue queue;
  EncoderBatch batch;
  EXPECT_FALSE(queue.take(batch));
  for (std::int64_t i = 0; i < 65'537; ++i) queue.put({i, {i}, false});
  for (std::int64_t i = 0; i < 65'536; ++i) {
    ASSERT_TRUE(queue.take(batch));
    ASSERT_EQ(batch, (EncoderBatch{i, {i}, false}));
  }
  EXPECT_FALSE(queue.take(batch));
  queue.put({65'537, {7}, false});
  ASSERT_TRUE(queue.take(batch));
  EXPECT_EQ(batch, (EncoderBatch{65'537, {7}, true}));
}

TEST(CountsQueue, LongBatchesWaitInASmallerNumber) {
  CountsQueue queue;
  EncoderBatch batch;
  const std::vector<std::int64_t> many(1 << 20, 5);
  for (std::int64_t i = 0; i < 5; ++i) queue.put({i, many, false});
  for (std::int64_t i = 0; i < 4; ++i) {
    ASSERT_TRUE(queue.take(batch));
    EXPECT_EQ(batch.first_index, i);
  }
  EXPECT_FALSE(queue.take(batch));
  queue.put({5, {7}, false});
  ASSERT_TRUE(queue.take(batch));
  EXPECT_EQ(batch, (EncoderBatch{5, {7}, true}));
}

// Again and again, at any moment: no frame differs, and the framer allocates nothing for it.
TEST(RecordingTap, BeginsAndEndsWhileFramesFlow) {
  const splid::test::TempFolder folder;
  Config config = scene_config(4);
  const Measured plain = measure(config, open_scene(config));
  test::counted_thread = [] { return false; };  // nor ZeroMQ's, until the framer's are counted
  config.record.folder = folder.path("r");
  Publisher publisher(config.publish.endpoint, 1000);
  std::unique_ptr<TagSource> source = open_scene(config);
  const SourceInfo info = source->info();
  test::MeasuredStream stream(config, std::move(source), publisher, host_clock());
  std::vector<std::string> json;
  std::atomic<bool> flows{false};
  std::atomic<bool> over{false};
  std::size_t whole = 0;
  stream.observe([&](const FrameMessage&, const std::string& line) {
    json.push_back(repeatable(line));
    flows = true;
    return true;
  });
  std::jthread asking([&] {
    while (!flows) std::this_thread::sleep_for(std::chrono::milliseconds{1});
    test::allocations = 0;
    test::counted_thread = on_framer;
    while (!over) {
      Tap recording(config, info, host_clock(), say_nothing);
      stream.record(&recording);
      while (recording.file().empty() && !over) {
        std::this_thread::sleep_for(std::chrono::milliseconds{1});
      }
      stream.record(nullptr);
      whole += recording.summary().find("1 recordings; 0 tags lost") == 0 ? 1 : 0;
    }
  });
  (void)stream.run({});
  over = true;
  asking.join();
  const std::uint64_t allocated = test::allocations;
  test::counted_thread = nullptr;
  EXPECT_EQ(allocated, 0u);
  EXPECT_THAT(json, ElementsAreArray(plain.json));
  EXPECT_GE(whole, 2u);
  EXPECT_EQ(recordings_in(folder.path("r")).size(), whole);
  for (const std::string& file : recordings_in(folder.path("r"))) {
    EXPECT_FALSE(read_back(file).empty());
  }
}

TEST(RecordingTap, AFrozenDiskHoldsNoEndAndWhatItDidNotTakeIsSaidAsLost) {
  static FrozenClock clock;  // outlives the recorder that is given up
  const splid::test::TempFolder folder;
  Config config = scene_config(0);
  config.record.folder = folder.path("r");
  const auto said = std::make_shared<int>(0);
  auto tap = std::make_unique<Tap>(config, SourceInfo{"script", true, {}}, clock,
                                   [said](const std::string&) { ++*said; });
  tap->take(photons(1000));
  const Ended ended = end_within(std::move(tap), std::chrono::milliseconds{50});
  EXPECT_FALSE(ended.whole);
  EXPECT_EQ(ended.text,
            "the recording: the disk does not take what is left; up to 1,000 tags are lost");
  EXPECT_EQ(said.use_count(), 1);  // nothing is reported any more: the receiver may be gone
  clock.thaw();
  EXPECT_TRUE(test::eventually([&] {
    const std::vector<std::string> files = recordings_in(folder.path("r"));
    return files.size() == 1 && read_back(files[0]).size() == 1000;
  }));
}

TEST(RecordingTap, AStopEndsAReplaysWaitForTheDisk) {
  static FrozenClock clock;
  const splid::test::TempFolder folder;
  Config config = scene_config(0);
  config.record.folder = folder.path("r");
  const auto ring = static_cast<std::uint64_t>(config.pipeline.ring_capacity_tags);
  auto tap = std::make_unique<Tap>(config, SourceInfo{"script", false, {}}, clock, say_nothing);
  tap->hurry();
  tap->take(photons(static_cast<std::int64_t>(ring) + 1000));
  const Ended frozen = [&] {
    clock.thaw();
    return end_within(std::move(tap), test::patience);
  }();
  EXPECT_TRUE(frozen.whole);
  EXPECT_THAT(frozen.text, HasSubstr("1 recordings; 1,000 tags lost"));
}

}  // namespace
}  // namespace splid::recording
