#include "daemon/recording/recorder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <vector>

#include "drivers/replay/recording_info.hpp"
#include "protocol/error.hpp"
#include "tests/support/read_back.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

using splid::test::read_back;
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

TEST(Recorder, WhatWasWrittenReadsBackInTheTaggersClock) {
  const splid::test::TempFolder folder;
  const std::string file = folder.path("a.ptu");
  const std::vector<Tag> tags = some_tags(10'000);
  Recorder recorder(file, facts(), clock_from(1e9), false);
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

TEST(Recorder, TheFileCanBeReadAtAnyMoment) {
  const splid::test::TempFolder folder;
  const std::string file = folder.path("a.ptu");
  const std::vector<Tag> tags = some_tags(100);
  {
    Recorder recorder(file, facts(), clock_from(0), false);
    EXPECT_THAT(read_back(file), ElementsAre());
    recorder.write(tags);
    recorder.flush();
    EXPECT_GE(read_back(file).size(), 98u);
  }
  // Never closed: as after a kill. All but the last microsecond is there.
  EXPECT_GE(read_back(file).size(), 98u);
  EXPECT_EQ(scan_recording(file).header.record_count, 0u);
}

TEST(Recorder, LossesAreInTheHeaderFromTheNextFlush) {
  const splid::test::TempFolder folder;
  const std::string file = folder.path("a.ptu");
  Recorder recorder(file, facts(), clock_from(0), false);
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

TEST(Recorder, RefusesToOverwriteUnlessToldTo) {
  const splid::test::TempFolder folder;
  const std::string file = folder.write("a.ptu", "precious");
  try {
    const Recorder recorder(file, facts(), clock_from(0), false);
    FAIL() << "overwritten";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::usage);
    EXPECT_THAT(error.what(), HasSubstr("--force"));
  }
  EXPECT_EQ(std::filesystem::file_size(file), 8u);
  Recorder recorder(file, facts(), clock_from(0), true);
  recorder.close();
  EXPECT_THAT(read_back(file), ElementsAre());
}

TEST(Recorder, AFullDiskIsADeviceErrorAndTheFileStaysReadable) {
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
    Recorder recorder(file, facts(), clock_from(0), false);
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

TEST(Recorder, AFolderThatIsNotThereIsADeviceError) {
  try {
    const Recorder recorder("/nowhere/at/all.ptu", facts(), clock_from(0), false);
    FAIL() << "made";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::device);
    EXPECT_THAT(error.what(), HasSubstr("/nowhere/at/all.ptu"));
  }
}

}  // namespace
}  // namespace splid
