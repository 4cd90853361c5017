#include "daemon/recording/rotating_writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "daemon/recording/recording_facts.hpp"
#include "drivers/replay/recording_info.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/held_clock.hpp"
#include "tests/support/read_back.hpp"
#include "tests/support/small_disk.hpp"

namespace splid::recording {
namespace {

using splid::test::read_back;
using splid::test::recordings_in;
using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::int64_t stream_second_ps = 1'000'000'000'000;
constexpr std::int64_t writer_epoch_ps = 340'000 * stream_second_ps;

// Photons and syncs, 1 us apart.
std::vector<Tag> steady_tags(std::int64_t begin_ps, std::int64_t count) {
  std::vector<Tag> tags;
  for (std::int64_t i = 0; i < count; ++i) {
    const std::int64_t time_ps = begin_ps + i * 1'000'000;
    tags.push_back(i % 4 == 0 ? sync_tag(time_ps) : photon_tag(time_ps, 1));
  }
  return tags;
}

class RotatingWriterTest : public ::testing::Test {
 protected:
  RotatingWriter recorder_in(const std::string& path) {
    config.record.folder = path;
    const SourceInfo source{"script", true, {}};
    return RotatingWriter(
        {config.record, config.channels, source, header_facts(config, source, "")}, clock,
        [] { return nullptr; }, [this](const std::string& sentence) { said.push_back(sentence); });
  }
  // In pieces that no limit falls on.
  static void feed(RotatingWriter& recorder, std::span<const Tag> tags) {
    while (!tags.empty()) {
      const std::size_t count = std::min<std::size_t>(tags.size(), 10'007);
      recorder.take(tags.first(count));
      tags = tags.subspan(count);
    }
  }
  static std::vector<Tag> read_all(const std::string& path) {
    std::vector<Tag> tags;
    for (const std::string& file : recordings_in(path)) {
      const std::vector<Tag> part = read_back(file);
      tags.insert(tags.end(), part.begin(), part.end());
    }
    return tags;
  }
  static std::uint64_t told_lost(const std::string& path) {
    std::int64_t lost = 0;
    for (const std::string& file : recordings_in(path)) {
      for (const Loss& loss : scan_recording(file).header.losses) lost += loss.count;
    }
    return static_cast<std::uint64_t>(lost);
  }

  splid::test::TempFolder folder;
  HeldClock clock;
  Config config = scene_config(0);
  std::vector<std::string> said;
};

TEST_F(RotatingWriterTest, AClockNearItsRangesEndIsRecordedToo) {
  config.record.max_file_s = 1e6;
  const std::vector<Tag> tags = steady_tags(9'200'000 * stream_second_ps, 1000);
  RotatingWriter recorder = recorder_in(folder.path("r"));
  recorder.take(tags);
  recorder.close();
  EXPECT_THAT(read_all(folder.path("r")), ElementsAreArray(tags));
}

// 3 s is within the file, 10,000 s is not.
TEST_F(RotatingWriterTest, OneTagFarAheadCostsThatTagAlone) {
  const std::vector<Tag> tags = steady_tags(writer_epoch_ps, 1000);
  for (const std::int64_t ahead_s : {3, 10'000}) {
    std::vector<Tag> with_stray = tags;
    with_stray.insert(with_stray.begin() + 500,
                      photon_tag(writer_epoch_ps + ahead_s * stream_second_ps, 1));
    const std::string path = folder.path(std::to_string(ahead_s));
    RotatingWriter recorder = recorder_in(path);
    recorder.take(with_stray);
    recorder.close();
    EXPECT_THAT(read_all(path), ElementsAreArray(tags));
    EXPECT_EQ(recordings_in(path).size(), 1U);
    EXPECT_EQ(told_lost(path), 1U);
    EXPECT_EQ(recorder.strays(), 1U);
    EXPECT_EQ(recorder.rejected(), 0U);
  }
}

TEST_F(RotatingWriterTest, AClockThatIsSetBackWithoutAWordCostsFifteenTags) {
  const std::vector<Tag> before = steady_tags(writer_epoch_ps, 500);
  const std::vector<Tag> after = steady_tags(writer_epoch_ps - 60 * stream_second_ps, 500);
  RotatingWriter recorder = recorder_in(folder.path("r"));
  recorder.take(before);
  recorder.take(after);
  recorder.close();
  const std::vector<std::string> files = recordings_in(folder.path("r"));
  ASSERT_EQ(files.size(), 2U);
  EXPECT_THAT(read_back(files[0]), ElementsAreArray(before));
  EXPECT_THAT(read_back(files[1]), ElementsAreArray(std::span(after).subspan(15)));
  EXPECT_EQ(recorder.rejected(), 15U);
}

TEST_F(RotatingWriterTest, FilesOfOneLengthFollowEachOtherWithoutAGap) {
  config.record.max_file_s = 0.1;
  std::vector<Tag> tags = steady_tags(writer_epoch_ps, 250'000);
  std::swap(tags[100'000], tags[100'001]);  // disorder at the cut
  RotatingWriter recorder = recorder_in(folder.path("r"));
  feed(recorder, tags);
  recorder.close();
  const std::vector<std::string> files = recordings_in(folder.path("r"));
  ASSERT_EQ(files.size(), 3u);
  EXPECT_EQ(recorder.files(), 3u);
  EXPECT_EQ(recorder.file_bytes(), std::filesystem::file_size(files[2]));
  const std::vector<Tag> last = read_back(files[2]);
  EXPECT_EQ(recorder.file_seconds(),
            static_cast<double>(last.back().time_ps - last.front().time_ps) / 1e12);
  std::swap(tags[100'000], tags[100'001]);
  EXPECT_TRUE(read_all(folder.path("r")) == tags);
  EXPECT_EQ(read_back(files[0]).size(), 100'000u);
  EXPECT_EQ(read_back(files[1]).front(), tags[100'000]);
  for (const std::string& file : files) {
    const RecordingInfo info = scan_recording(file);
    EXPECT_THAT(info.warnings, IsEmpty());
    EXPECT_THAT(info.header.losses, IsEmpty());
    EXPECT_THAT(info.header.pattern_json, HasSubstr("splid.pattern"));
    EXPECT_THAT(info.header.config_json, HasSubstr("\"max_file_s\":0.1"));
  }
  EXPECT_THAT(said, IsEmpty());
}

TEST_F(RotatingWriterTest, FilesEndAtTheirSizeAndTheOldestMakeRoom) {
  config.record.max_file_mib = 1;
  config.record.max_folder_gib = 4.0 / 1024;
  const std::vector<Tag> tags = steady_tags(0, 2'500'000);  // 9.8 MiB
  RotatingWriter recorder = recorder_in(folder.path("r"));
  feed(recorder, tags);
  recorder.close();
  EXPECT_GE(recorder.files(), 9u);
  std::uintmax_t bytes = 0;
  for (const std::string& file : recordings_in(folder.path("r"))) {
    EXPECT_LT(std::filesystem::file_size(file), 2u << 20);
    bytes += std::filesystem::file_size(file);
  }
  EXPECT_LE(bytes, 4u << 20);
  const std::vector<Tag> kept = read_all(folder.path("r"));
  ASSERT_GT(kept.size(), 262'144u);
  EXPECT_TRUE(std::ranges::equal(kept, std::span(tags).last(kept.size())));
}

TEST_F(RotatingWriterTest, AClockSetAnewAndAnOpenLossGoOnInTheNextFile) {
  config.record.max_file_s = 1;
  RotatingWriter recorder = recorder_in(folder.path("r"));
  const std::vector<Tag> before = steady_tags(5 * stream_second_ps, 10);
  const std::vector<Tag> after = steady_tags(7, 10);
  recorder.take(before);
  recorder.take(std::vector<Tag>{{0, 0, TagKind::clock_break, {}}});
  recorder.take(after);
  recorder.take(std::vector<Tag>{{stream_second_ps / 2, 0, TagKind::loss_begin, {}},
                                 heartbeat_tag(2 * stream_second_ps),
                                 {2 * stream_second_ps + 10, 5, TagKind::loss_end, {}}});
  recorder.close();
  const std::vector<std::string> files = recordings_in(folder.path("r"));
  ASSERT_EQ(files.size(), 3u);
  EXPECT_THAT(read_back(files[0]), ElementsAreArray(before));
  EXPECT_THAT(read_back(files[1]), ElementsAreArray(after));
  EXPECT_THAT(scan_recording(files[1]).header.losses,
              ElementsAre(Loss{7, 7, -1}, Loss{stream_second_ps / 2, stream_second_ps / 2, -1}));
  EXPECT_THAT(scan_recording(files[2]).header.losses,
              ElementsAre(Loss{2 * stream_second_ps, 2 * stream_second_ps + 10, 5}));
}

TEST_F(RotatingWriterTest, AFullDiskLosesACountedStretchAndIsTriedAgain) {
  const splid::test::SmallDisk disk(16);
  if (!disk.mounted()) GTEST_SKIP() << "takes root, to mount a small disk";
  disk.fill_but(2 << 20);
  const std::vector<Tag> tags = steady_tags(writer_epoch_ps, 1'020'000);
  RotatingWriter recorder = recorder_in(disk.path("r"));
  feed(recorder, std::span(tags).first(800'000));  // 3.1 MiB
  EXPECT_THAT(recorder.fault(), HasSubstr("No space left on device"));
  ASSERT_EQ(said.size(), 1u);
  EXPECT_THAT(said[0], HasSubstr("nothing is recorded: "));
  clock.advance_ms(5000);
  feed(recorder, std::span(tags).subspan(800'000, 10'000));
  EXPECT_FALSE(recorder.fault().empty());  // there is still no room
  EXPECT_EQ(recordings_in(disk.path("r")).size(), 1u);
  disk.clear();
  feed(recorder, std::span(tags).subspan(810'000, 10'000));
  EXPECT_FALSE(recorder.fault().empty());  // not yet looked again
  clock.advance_ms(5000);
  feed(recorder, std::span(tags).subspan(820'000));
  EXPECT_EQ(recorder.fault(), "");
  recorder.close();
  ASSERT_EQ(recordings_in(disk.path("r")).size(), 2u);
  const std::vector<Tag> kept = read_all(disk.path("r"));
  EXPECT_GT(recorder.lost_tags(), 20'000u);
  EXPECT_EQ(kept.size() + recorder.lost_tags(), tags.size());
  EXPECT_EQ(told_lost(disk.path("r")), recorder.lost_tags());
  EXPECT_TRUE(std::ranges::equal(std::span(kept).last(200'000), std::span(tags).last(200'000)));
}

// The header has its place and the first record none, so the file goes. What was lost before it,
// with a count and without, is told by the next file, and so are the tags that it would have had.
TEST_F(RotatingWriterTest, LossesOfAFileThatGotNoTagGoToTheNext) {
  RotatingWriter recorder = recorder_in(folder.path("r"));
  recorder.take(std::vector<Tag>{{1'000'000, 0, TagKind::loss_begin, {}},
                                 {2'000'000, -1, TagKind::loss_end, {}},
                                 {3'000'000, 5, TagKind::missed, {}},
                                 photon_tag(4'000'000, 1),
                                 photon_tag(5'000'000, 1)});
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit header{std::filesystem::file_size(recordings_in(folder.path("r")).at(0)),
                      before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &header), 0);
  recorder.flush();
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(recorder.fault(), HasSubstr("File too large"));
  EXPECT_EQ(recorder.files(), 0U);
  EXPECT_THAT(recordings_in(folder.path("r")), IsEmpty());
  clock.advance_ms(5000);
  const std::vector<Tag> tags = steady_tags(30'000'000, 3);
  recorder.take(tags);
  recorder.close();
  const std::vector<std::string> files = recordings_in(folder.path("r"));
  ASSERT_EQ(files.size(), 1U);
  EXPECT_THAT(read_back(files[0]), ElementsAreArray(tags));
  EXPECT_THAT(scan_recording(files[0]).header.losses,
              ElementsAre(Loss{30'000'000, 30'000'000, 7}, Loss{30'000'000, 30'000'000, -1}));
  EXPECT_EQ(recorder.lost_tags(), 2U);
}

TEST_F(RotatingWriterTest, AFolderThatIsRemovedLosesItsFileAndIsMadeAnew) {
  const std::string path = folder.path("r");
  const std::vector<Tag> tags = steady_tags(writer_epoch_ps, 300'000);
  RotatingWriter recorder = recorder_in(path);
  feed(recorder, std::span(tags).first(100'000));
  recorder.take(std::vector<Tag>{{tags[99'999].time_ps, 7, TagKind::missed, {}}});
  recorder.flush();
  EXPECT_EQ(recorder.fault(), "");
  std::filesystem::remove_all(path);
  recorder.flush();
  EXPECT_THAT(recorder.fault(), HasSubstr(".ptu: was removed while it was written"));
  EXPECT_EQ(recorder.lost_tags(), 100'000u);
  EXPECT_EQ(recorder.files(), 0u);
  feed(recorder, std::span(tags).subspan(100'000, 100'000));
  EXPECT_EQ(recorder.lost_tags(), 200'000u);
  EXPECT_FALSE(std::filesystem::exists(path));
  clock.advance_ms(5000);
  feed(recorder, std::span(tags).subspan(200'000));
  EXPECT_EQ(recorder.fault(), "");
  // The new folder is this recorder's alone.
  RotatingWriter other = recorder_in(path);
  other.take(std::span(tags).first(10));
  EXPECT_THAT(other.fault(), HasSubstr("another splid records into it"));
  recorder.close();
  EXPECT_EQ(recorder.files(), 1u);
  EXPECT_TRUE(std::ranges::equal(read_all(path), std::span(tags).subspan(200'000)));
  EXPECT_EQ(told_lost(path), 200'007u);
  ASSERT_EQ(said.size(), 3u);
  EXPECT_THAT(said[0], HasSubstr("nothing is recorded: "));
  EXPECT_THAT(said[1], HasSubstr("recording again, into "));
}

// The file ends before it is looked at again.
TEST_F(RotatingWriterTest, AFileThatIsRemovedBeforeItsEndIsNotCountedAsRecorded) {
  const std::string path = folder.path("r");
  config.record.max_file_s = 1;
  const std::vector<Tag> tags = steady_tags(writer_epoch_ps, 1'000'000);
  RotatingWriter recorder = recorder_in(path);
  feed(recorder, tags);
  for (const std::string& file : recordings_in(path)) std::filesystem::remove(file);
  recorder.close();
  EXPECT_EQ(recorder.files(), 0u);
  EXPECT_EQ(recorder.lost_tags(), 1'000'000u);
  EXPECT_THAT(said, ElementsAre(HasSubstr("was removed while it was written"),
                                HasSubstr("1,000,000 tags are in no recording")));
}

TEST_F(RotatingWriterTest, AFolderThatCannotBeMadeLeavesNothingUnsaid) {
  const std::string file = folder.write("file", "");
  RotatingWriter recorder = recorder_in(file + "/r");
  recorder.take(steady_tags(0, 10));
  recorder.take(std::vector<Tag>{{20'000'000, 7, TagKind::missed, {}}});
  EXPECT_THAT(recorder.fault(), HasSubstr("record.folder"));
  EXPECT_EQ(recorder.lost_tags(), 10u);
  std::filesystem::remove(file);
  clock.advance_ms(5000);
  const std::vector<Tag> tags = steady_tags(30'000'000, 3);
  recorder.take(tags);
  recorder.close();
  EXPECT_THAT(read_all(file + "/r"), ElementsAreArray(tags));
  EXPECT_EQ(told_lost(file + "/r"), 17u);
  EXPECT_THAT(said, ElementsAre(HasSubstr("nothing is recorded"), HasSubstr("recording again")));
}

// The recording is there before its encoder counts are found to have no place.
TEST_F(RotatingWriterTest, AFileWhoseCountsHaveNoPlaceIsNotCounted) {
  struct Counts final : EncoderSource {
    bool next(EncoderBatch& /*batch*/) override { return false; }
    [[nodiscard]] bool live() const override { return true; }
  };
  const std::string path = folder.path("r");
  {
    RotatingWriter first = recorder_in(path);
    first.take(steady_tags(writer_epoch_ps, 10));
    first.close();
  }
  const std::string file = recordings_in(path).at(0);
  std::filesystem::remove(file);
  std::filesystem::create_directories(encoder_file_of(file) + "/in-the-way");
  const SourceInfo source{"script", true, {}};
  RotatingWriter recorder(
      {config.record, config.channels, source, header_facts(config, source, "")}, clock,
      [] { return std::make_unique<Counts>(); },
      [this](const std::string& sentence) { said.push_back(sentence); });
  recorder.take(steady_tags(writer_epoch_ps, 10));
  recorder.close();
  EXPECT_THAT(said, ElementsAre(HasSubstr("nothing is recorded: "),
                                HasSubstr("10 tags are in no recording")));
  EXPECT_EQ(recorder.files(), 0U);
}

}  // namespace
}  // namespace splid::recording
