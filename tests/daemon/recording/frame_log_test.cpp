#include "daemon/recording/frame_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "protocol/frame_columns.hpp"
#include "tests/support/patience.hpp"
#include "tests/support/program.hpp"
#include "tests/support/small_disk.hpp"

namespace splid::recording {
namespace {

using test::file_text;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const TableFacts live_facts{"splid", "{}", "{}", ""};

TableFacts replay_facts(const test::TempFolder& folder) {
  TableFacts facts = live_facts;
  facts.recording = folder.write("a.ptu", "abc");
  return facts;
}

FrameMessage numbered_frame(std::uint64_t sequence) {
  FrameMessage message;
  message.sequence = sequence;
  return message;
}

std::size_t lines_in(const std::string& file) {
  const std::string text = file_text(file);
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

// What a log says, from its own thread.
struct Said {
  void operator()(const std::string& sentence) {
    const std::scoped_lock lock(mutex);
    sentences.push_back(sentence);
  }
  std::mutex mutex;
  std::vector<std::string> sentences;
};

template <class Condition>
bool comes_true(Condition condition) {
  const auto until = std::chrono::steady_clock::now() + test::patience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds{5});
  }
  return true;
}

TEST(FrameLog, AReplaysTableIsWholeAndHasTheChecksum) {
  const test::TempFolder folder;
  Said said;
  FrameLog log(folder.path("a.csv"), replay_facts(folder), false, std::ref(said));
  // More than the queue holds: put() waits for room.
  constexpr std::uint64_t count = 10'000;
  for (std::uint64_t i = 0; i < count; ++i) log.put(numbered_frame(i));
  log.finish({});
  EXPECT_EQ(log.fault(), "");
  EXPECT_EQ(log.summary(), "10,000 frames in " + folder.path("a.csv"));
  EXPECT_EQ(lines_in(folder.path("a.csv")), count + 1);
  EXPECT_THAT(file_text(folder.path("a.csv.facts.json")), HasSubstr("\"ba7816bf8f01cfea"));
  EXPECT_TRUE(said.sentences.empty());
}

// A replay that waits for room gets it at once, not when the next second of frames is written.
TEST(FrameLog, AFullQueueIsTakenAtOnce) {
  const test::TempFolder folder;
  Said said;
  FrameLog log(folder.path("a.csv"), replay_facts(folder), false, std::ref(said));
  const FrameMessage frame = numbered_frame(0);
  constexpr std::uint64_t room = 4096;
  auto least = std::chrono::steady_clock::duration::max();
  for (std::uint64_t count = 0, round = 1; round <= 4; ++round) {
    for (std::uint64_t i = 0; i < room; ++i) log.put(frame);
    const auto begin = std::chrono::steady_clock::now();
    log.put(frame);
    least = std::min(least, std::chrono::steady_clock::now() - begin);
    count += room + 1;
    ASSERT_TRUE(comes_true([&] { return lines_in(folder.path("a.csv")) == count + 1; }));
  }
  EXPECT_LT(least, std::chrono::milliseconds{100});
}

TEST(FrameLog, ATableThatIsRemovedIsAFaultAndAllItsFramesAreCounted) {
  const test::TempFolder folder;
  Said said;
  FrameLog log(live_facts, std::ref(said));
  log.put(numbered_frame(0), folder.path("1.csv"), "1.ptu");
  log.put(numbered_frame(1), folder.path("1.csv"), "1.ptu");
  ASSERT_TRUE(comes_true([&] { return lines_in(folder.path("1.csv")) == 3; }));
  std::filesystem::remove(folder.path("1.csv"));
  EXPECT_TRUE(comes_true([&] { return !log.fault().empty(); }));
  EXPECT_THAT(log.fault(), HasSubstr("1.csv: was removed while it was written"));
  log.put(numbered_frame(2), folder.path("1.csv"), "1.ptu");
  log.put(numbered_frame(3), folder.path("2.csv"), "2.ptu");
  log.finish({});
  EXPECT_EQ(log.fault(), "");
  EXPECT_EQ(log.summary(), "1 frames in 2 tables; 3 frames are in no table");
  EXPECT_EQ(lines_in(folder.path("2.csv")), 2u);
}

TEST(FrameLog, ALiveSourceHasATableForEachRecording) {
  const test::TempFolder folder;
  Said said;
  FrameLog log(live_facts, std::ref(said));
  log.put(numbered_frame(0), folder.path("1.csv"), "1.ptu");
  log.put(numbered_frame(1), folder.path("1.csv"), "1.ptu");
  log.put(numbered_frame(2), folder.path("2.csv"), "2.ptu");
  log.finish({});
  EXPECT_EQ(log.summary(), "3 frames in 2 tables");
  EXPECT_EQ(file_text(folder.path("1.csv")),
            frame_csv_head() + frame_csv_row(numbered_frame(0)) + frame_csv_row(numbered_frame(1)));
  EXPECT_EQ(file_text(folder.path("2.csv")), frame_csv_head() + frame_csv_row(numbered_frame(2)));
  EXPECT_THAT(file_text(folder.path("2.csv.facts.json")), HasSubstr("\"recording\":\"2.ptu\""));
}

// The sums are those of "abc" and of nothing.
TEST(FrameLog, ALiveSourcesTablesHaveTheChecksumsOfTheirRecordings) {
  const test::TempFolder folder;
  Said said;
  FrameLog log(live_facts, std::ref(said));
  log.put(numbered_frame(0), folder.path("1.csv"), folder.write("1.ptu", "abc"));
  log.put(numbered_frame(1), folder.path("2.csv"), folder.write("2.ptu", ""));
  const auto has = [&](const char* facts, const char* sum) {
    return file_text(folder.path(facts)).find(sum) != std::string::npos;
  };
  EXPECT_TRUE(comes_true([&] { return has("1.csv.facts.json", "\"ba7816bf8f01cfea"); }))
      << "while the second recording goes on";
  EXPECT_FALSE(has("2.csv.facts.json", "\"e3b0c44298fc1c14"));
  log.finish({});
  EXPECT_TRUE(has("2.csv.facts.json", "\"e3b0c44298fc1c14"));
  EXPECT_THAT(said.sentences, ElementsAre());
}

// The frames come far faster than a disk or the queue could take them.
TEST(FrameLog, ALiveSourceNeverWaits) {
  const test::TempFolder folder;
  Said said;
  FrameLog log(live_facts, std::ref(said));
  constexpr std::uint64_t count = 400'000;
  for (std::uint64_t i = 0; i < count; ++i)
    log.put(numbered_frame(i), folder.path("1.csv"), "1.ptu");
  log.finish({});
  const std::uint64_t written = lines_in(folder.path("1.csv")) - 1;
  ASSERT_LT(written, count);
  EXPECT_GE(written, 4096U);
  const std::string text = log.summary();
  std::string digits;
  std::copy_if(text.begin() + static_cast<std::ptrdiff_t>(text.find(';')), text.end(),
               std::back_inserter(digits), [](unsigned char c) { return std::isdigit(c) != 0; });
  EXPECT_EQ(written + std::stoull(digits), count) << text;
  ASSERT_FALSE(said.sentences.empty());
  EXPECT_THAT(said.sentences.front(), HasSubstr("the disk is too slow; "));
}

TEST(FrameLog, AFullDiskIsSaidAndCountedAndOver) {
  const test::SmallDisk disk(4);
  if (!disk.mounted()) GTEST_SKIP() << "takes root, to mount a small disk";
  Said said;
  FrameLog log(live_facts, std::ref(said));
  const std::string file = disk.path("1.csv");
  log.put(numbered_frame(0), file, "1.ptu");
  ASSERT_TRUE(comes_true([&] { return lines_in(file) == 2; }));
  disk.fill_but(0);
  for (std::uint64_t i = 1; i <= 1000; ++i) log.put(numbered_frame(i), file, "1.ptu");
  ASSERT_TRUE(comes_true([&] { return !log.fault().empty(); }));
  EXPECT_THAT(log.fault(), HasSubstr("No space left on device"));
  disk.clear();
  log.put(numbered_frame(1001), file, "1.ptu");
  ASSERT_TRUE(comes_true([&] { return log.fault().empty(); }));
  log.finish({});
  EXPECT_THAT(log.summary(), HasSubstr("2 frames in " + file + "; 1,000 frames are in no table"));
  EXPECT_THAT(said.sentences, ElementsAre(HasSubstr("frames are not written: "),
                                          HasSubstr("frames are written again, into ")));
}

TEST(FrameLog, ATableThatCannotBeMadeIsTriedAgain) {
  const test::TempFolder folder;
  Said said;
  FrameLog log(live_facts, std::ref(said));
  const std::string file = folder.path("later/1.csv");
  log.put(numbered_frame(0), file, "1.ptu");
  ASSERT_TRUE(comes_true([&] { return !log.fault().empty(); }));
  std::filesystem::create_directory(folder.path("later"));
  log.put(numbered_frame(1), file, "1.ptu");
  ASSERT_TRUE(comes_true([&] { return log.fault().empty(); }));
  log.finish({});
  EXPECT_EQ(log.summary(), "1 frames in " + file + "; 1 frames are in no table");
}

}  // namespace
}  // namespace splid::recording
