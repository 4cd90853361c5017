#include "daemon/recording/ptu_writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <filesystem>
#include <vector>

#include "drivers/replay/recording_info.hpp"
#include "protocol/error.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/read_back.hpp"
#include "tests/support/strict_ptu.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::recording {
namespace {

using splid::test::read_back;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;

constexpr std::int64_t epoch_ps = 340'000'000'000'000'000;

DeviceClock clock_from(double start_unix_s) {
  return {SourceInfo{"script", false, start_unix_s}, host_clock()};
}

PtuFacts facts() {
  PtuFacts made;
  made.instrument = "scripted";
  made.pattern_json = "{\"pattern\":1}";
  made.config_json = "{\"config\":1}";
  return made;
}

std::vector<Tag> some_tags(std::int64_t count) {
  std::vector<Tag> tags;
  for (std::int64_t i = 0; i < count; ++i) {
    tags.push_back(i % 5 == 0 ? sync_tag(epoch_ps + i * 1'000'000)
                              : photon_tag(epoch_ps + i * 1'000'000, 1 + static_cast<int>(i % 2)));
  }
  return tags;
}

TEST(PtuWriter, WhatWasWrittenReadsBackInTheTaggersClock) {
  const splid::test::TempFolder folder;
  const std::string file = folder.path("a.ptu");
  const std::vector<Tag> tags = some_tags(10'000);
  PtuWriter recorder(file, facts(), clock_from(1e9), false);
  recorder.write(std::span(tags).first(3));
  recorder.write(std::span(tags).subspan(3));
  recorder.close();
  EXPECT_THAT(read_back(file), ElementsAreArray(tags));
  const RecordingInfo info = scan_recording(file);
  EXPECT_EQ(info.header.record_count, recorder.records());
  EXPECT_EQ(info.header.pattern_json, "{\"pattern\":1}");
  EXPECT_EQ(info.header.config_json, "{\"config\":1}");
  EXPECT_NEAR(info.header.created_unix_s.value(), 1e9 + 340'000, 1e-3);
  EXPECT_EQ(recorder.bytes(), std::filesystem::file_size(file));
  EXPECT_THAT(info.warnings, ElementsAre());
}

TEST(PtuWriter, TheFileCanBeReadAtAnyMoment) {
  const splid::test::TempFolder folder;
  const std::string file = folder.path("a.ptu");
  const std::vector<Tag> tags = some_tags(100);
  {
    PtuWriter recorder(file, facts(), clock_from(0), false);
    EXPECT_THAT(read_back(file), ElementsAre());
    recorder.write(tags);
    recorder.flush();
    EXPECT_GE(read_back(file).size(), 98u);
  }
  // Never closed: as after a kill. All but the last microsecond is there.
  EXPECT_GE(read_back(file).size(), 98u);
  const test::StrictPtu strict = test::read_strictly(file);
  EXPECT_TRUE(strict.readable);
  EXPECT_EQ(strict.counted, strict.held);
  EXPECT_THAT(scan_recording(file).warnings, ElementsAre());
}

// Never closed: the header names the inputs before their records are in the file.
TEST(PtuWriter, TheHeaderNamesTheInputsThatHaveNoChannelOfTheirOwn) {
  const splid::test::TempFolder folder;
  const std::string file = folder.path("a.ptu");
  std::vector<Tag> tags;
  for (const int input : {1, 0, -1, 126}) {
    tags.push_back(
        photon_tag(epoch_ps + 2'000'000 * static_cast<std::int64_t>(tags.size()), input));
  }
  {
    PtuWriter recorder(file, facts(), clock_from(0), false);
    recorder.write(tags);
    recorder.write(std::vector<Tag>{heartbeat_tag(epoch_ps + 1'000'000'000)});
    recorder.flush();
    recorder.write(std::vector<Tag>{photon_tag(epoch_ps + 1'000'000'000, -2)});
  }
  EXPECT_THAT(read_back(file), ElementsAreArray(tags));
  EXPECT_EQ(scan_recording(file).header.text("Splid_Inputs"), "60:126 61:-1 62:0");
}

TEST(PtuWriter, AFileThatIsRemovedIsAFaultAndAllItsTagsAreLost) {
  const splid::test::TempFolder folder;
  const std::string file = folder.path("a.ptu");
  PtuWriter recorder(file, facts(), clock_from(0), false);
  recorder.write(some_tags(100));
  recorder.flush();
  std::filesystem::rename(file, folder.path("b.ptu"));
  recorder.flush();  // the file has another name, and loses nothing
  std::filesystem::remove(folder.path("b.ptu"));
  const auto says = AllOf(HasSubstr(file + ": was removed"), HasSubstr(" tags are lost"));
  EXPECT_THAT(test::error_text([&] { recorder.flush(); }), says);
  EXPECT_THAT(test::error_text([&] { recorder.close(); }), says);
  EXPECT_TRUE(recorder.removed());
  EXPECT_EQ(recorder.give_up(), 100u);
}

TEST(PtuWriter, TheHeaderCountsWhatIsInTheFileAtEachBlockAndFlush) {
  const splid::test::TempFolder folder;
  const std::string file = folder.path("a.ptu");
  const std::vector<Tag> tags = some_tags(600'000);
  PtuWriter recorder(file, facts(), clock_from(0), false);
  EXPECT_EQ(test::read_strictly(file).counted, 0u);
  std::uint64_t before = 0;
  int grown = 0;
  for (std::size_t from = 0; from < tags.size(); from += 50'000) {
    recorder.write(std::span(tags).subspan(from, 50'000));
    if (from % 200'000 == 0) recorder.flush();
    const test::StrictPtu strict = test::read_strictly(file);
    ASSERT_TRUE(strict.readable);
    EXPECT_EQ(strict.counted, strict.held);
    EXPECT_EQ(strict.counted, recorder.written_records());
    if (from % 200'000 == 0) {
      EXPECT_GE(strict.photons + strict.syncs + 2, from + 50'000);
    }
    grown += strict.counted > before ? 1 : 0;
    before = strict.counted;
  }
  EXPECT_GE(grown, 3);
  recorder.close();
  const test::StrictPtu strict = test::read_strictly(file);
  EXPECT_EQ(strict.photons + strict.syncs, tags.size());
  EXPECT_EQ(strict.counted, strict.held);
}

// A loss that is written into the header leaves the count as it is.
TEST(PtuWriter, TheCountStaysTrueAsLossesAreWritten) {
  const splid::test::TempFolder folder;
  const std::string file = folder.path("a.ptu");
  PtuWriter recorder(file, facts(), clock_from(0), false);
  for (std::int64_t i = 1; i < 2'000; ++i) {
    const std::int64_t at_ps = i * 10'000'000;
    recorder.write(std::vector<Tag>{photon_tag(at_ps, 1), {at_ps + 1, 1, TagKind::missed, {}}});
    if (i % 100 != 0) continue;
    recorder.flush();
    const test::StrictPtu strict = test::read_strictly(file);
    ASSERT_TRUE(strict.readable);
    EXPECT_EQ(strict.counted, strict.held);
  }
  recorder.close();
  EXPECT_EQ(recorder.lost_tags(), 1'999u);
}

TEST(PtuWriter, LossesAreInTheHeaderFromTheNextFlush) {
  const splid::test::TempFolder folder;
  const std::string file = folder.path("a.ptu");
  PtuWriter recorder(file, facts(), clock_from(0), false);
  recorder.write(std::vector<Tag>{photon_tag(1'000'000, 1),
                                  {2'000'000, 0, TagKind::loss_begin, {}},
                                  {3'000'000, 42, TagKind::loss_end, {}},
                                  photon_tag(9'000'000, 1)});
  recorder.flush();
  EXPECT_THAT(scan_recording(file).header.losses, ElementsAre(Loss{2'000'000, 3'000'000, 42}));
  recorder.close();
  EXPECT_THAT(scan_recording(file).header.losses, ElementsAre(Loss{2'000'000, 3'000'000, 42}));
  EXPECT_EQ(recorder.lost_tags(), 42u);
}

// Whoever kills the program leaves no file without a header.
TEST(PtuWriter, ANewFileHasItsHeaderWhenItGetsItsName) {
  const splid::test::TempFolder folder;
  const int watch = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  ASSERT_GE(inotify_add_watch(watch, folder.path(".").c_str(), IN_CREATE | IN_MODIFY), 0);
  const PtuWriter writer(folder.path("a.ptu"), facts(), clock_from(1e9), false);
  EXPECT_TRUE(splid::test::read_strictly(folder.path("a.ptu")).readable);
  alignas(inotify_event) std::array<char, 4096> room{};
  const ssize_t bytes = ::read(watch, room.data(), room.size());
  ::close(watch);
  std::vector<std::uint32_t> happened;  // to that name
  for (ssize_t at = 0; at < bytes;) {
    const auto* event = reinterpret_cast<const inotify_event*>(room.data() + at);
    if (event->name == std::string("a.ptu")) happened.push_back(event->mask);
    at += static_cast<ssize_t>(sizeof *event + event->len);
  }
  EXPECT_THAT(happened, ElementsAre(IN_CREATE));  // and not written to
}

TEST(PtuWriter, RefusesToOverwriteUnlessToldTo) {
  const splid::test::TempFolder folder;
  const std::string file = folder.write("a.ptu", "precious");
  try {
    const PtuWriter recorder(file, facts(), clock_from(0), false);
    FAIL() << "overwritten";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::usage);
    EXPECT_THAT(error.what(), HasSubstr("--force"));
  }
  EXPECT_EQ(std::filesystem::file_size(file), 8u);
  PtuWriter recorder(file, facts(), clock_from(0), true);
  recorder.close();
  EXPECT_THAT(read_back(file), ElementsAre());
}

// A header of 100 bytes and more does not fit: neither a file nor a device that was there is gone,
// and one that was not there is not left behind.
TEST(PtuWriter, WhatWasThereStaysWhereARecordingCannotBegin) {
  const splid::test::TempFolder folder;
  const std::string file = folder.write("a.ptu", "precious");
  const std::string device = folder.path("device");
  std::filesystem::create_symlink("/dev/full", device);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit little{100, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &little), 0);
  EXPECT_THROW(PtuWriter(file, facts(), clock_from(0), true), Error);
  EXPECT_THROW(PtuWriter(folder.path("new.ptu"), facts(), clock_from(0), true), Error);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_THROW(PtuWriter(device, facts(), clock_from(0), true), Error);
  EXPECT_EQ(test::file_text(file), "precious");
  EXPECT_TRUE(std::filesystem::is_character_file(device));
  EXPECT_FALSE(std::filesystem::exists(folder.path("new.ptu")));
}

// Nothing is allocated there and nothing cut, which a device cannot do.
TEST(PtuWriter, WritesToADeviceThatTakesAll) {
  const splid::test::TempFolder folder;
  const std::string device = folder.path("device");
  std::filesystem::create_symlink("/dev/null", device);
  PtuWriter writer(device, facts(), clock_from(0), true);
  writer.write(some_tags(1000));
  writer.close();
  EXPECT_EQ(writer.lost_tags(), 0U);
  EXPECT_TRUE(std::filesystem::is_character_file(device));
}

TEST(PtuWriter, WritesOverNoFolderPipeOrSocket) {
  const splid::test::TempFolder folder;
  const std::string pipe = folder.path("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const std::string sub_folder = folder.path("folder");
  std::filesystem::create_directory(sub_folder);
  for (const std::string& place : {pipe, sub_folder}) {
    EXPECT_THAT(test::error_text([&] { const PtuWriter r(place, facts(), clock_from(0), true); }),
                HasSubstr("is no file"));
    EXPECT_TRUE(std::filesystem::exists(place));
  }
}

TEST(PtuWriter, AFullDiskIsADeviceErrorAndTheFileStaysReadable) {
  const splid::test::TempFolder folder;
  const std::string file = folder.path("a.ptu");
  const std::vector<Tag> tags = some_tags(100'000);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit little{200'002, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &little), 0);
  std::string what;
  std::uint64_t lost = 0;
  {
    PtuWriter recorder(file, facts(), clock_from(0), false);
    try {
      recorder.write(tags);
      recorder.flush();
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::device);
      what = error.what();
    }
    lost = recorder.give_up();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(what, HasSubstr(file + ": File too large after 200002 bytes"));
  const std::vector<Tag> read = read_back(file);
  ASSERT_GT(read.size(), 10'000u);
  EXPECT_THAT(read, ElementsAreArray(std::span(tags).first(read.size())));
  EXPECT_EQ(read.size() + lost, tags.size());
  EXPECT_GT(scan_recording(file).header.record_count, read.size());
}

TEST(PtuWriter, AFolderThatIsNotThereIsADeviceError) {
  try {
    const PtuWriter recorder("/nowhere/at/all.ptu", facts(), clock_from(0), false);
    FAIL() << "made";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::device);
    EXPECT_THAT(error.what(), HasSubstr("/nowhere/at/all.ptu"));
  }
}

}  // namespace
}  // namespace splid::recording
