#include "daemon/recording/recording_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "protocol/error.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::recording {
namespace {

using ::testing::HasSubstr;

constexpr double evening_unix_s = 1795292100.75;  // 2026-11-21 20:15:00.75 UTC

TEST(RecordingFolder, NamesFilesByTimeAndARunningNumberThatGoesOn) {
  const splid::test::TempFolder folder;
  const std::string path = folder.path("a/b");
  {
    Folder first(path, 1000);
    EXPECT_EQ(first.next(evening_unix_s, 10), path + "/splid-20261121T201500Z-000001.ptu");
    EXPECT_EQ(first.next(evening_unix_s, 10), path + "/splid-20261121T201500Z-000002.ptu");
  }
  (void)folder.write("a/b/splid-20270101T000000Z-999999.ptu", "x");
  Folder second(path, 1000);
  EXPECT_EQ(second.next(0, 10), path + "/splid-19700101T000000Z-1000000.ptu");
  EXPECT_EQ(second.next(-0.5, 10), path + "/splid-19691231T235959Z-1000001.ptu");
}

TEST(RecordingFolder, RemovesItsOldestAndNothingElse) {
  const splid::test::TempFolder folder;
  const std::string hundred(100, 'x');
  const auto there = [&](const std::string& name) {
    return std::filesystem::exists(folder.path(name));
  };
  // The clock was set back between them: the numbers tell which came first.
  (void)folder.write("splid-20270101T000000Z-000007.ptu", hundred);
  (void)folder.write("splid-20270101T000000Z-000007.ptu.encoder.csv", hundred);
  (void)folder.write("splid-20270101T000000Z-000007.ptu.frames.h5", "");
  (void)folder.write("splid-20270101T000000Z-000007.ptu.frames.csv", "");
  (void)folder.write("splid-20270101T000000Z-000007.ptu.frames.csv.facts.json", "");
  (void)folder.write("splid-20260101T000000Z-000008.ptu", hundred);
  (void)folder.write("splid-20260101T000000Z-000009.ptu", hundred);
  for (const char* other : {"splid-20260101T000000Z-000001.ptu2", "splid-2026-000001.ptu",
                            "Splid-20260101T000000Z-000001.ptu", "splid-20260101T000000Z-00001.ptu",
                            "splid-20260101T000000Z-0000x1.ptu", "mine.ptu"}) {
    (void)folder.write(other, hundred);
  }
  Folder recordings(folder.path(""), 500);
  (void)recordings.next(evening_unix_s, 100);
  EXPECT_TRUE(there("splid-20270101T000000Z-000007.ptu"));
  (void)recordings.next(evening_unix_s, 101);
  EXPECT_FALSE(there("splid-20270101T000000Z-000007.ptu"));
  EXPECT_FALSE(there("splid-20270101T000000Z-000007.ptu.encoder.csv"));
  EXPECT_TRUE(there("splid-20260101T000000Z-000008.ptu"));
  (void)recordings.next(evening_unix_s, 500);
  EXPECT_FALSE(there("splid-20260101T000000Z-000009.ptu"));
  const std::filesystem::directory_iterator begin(folder.path(""));
  EXPECT_EQ(std::distance(begin, std::filesystem::directory_iterator()), 6);
}

TEST(RecordingFolder, BelongsToOneAtATime) {
  const splid::test::TempFolder folder;
  Folder second(folder.path(""), 1000);
  {
    Folder first(folder.path(""), 1000);
    (void)first.next(evening_unix_s, 10);
    (void)first.next(evening_unix_s, 10);
    try {
      (void)second.next(evening_unix_s, 10);
      FAIL() << "took another's folder";
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("another splid records into it"));
      EXPECT_EQ(error.fault(), Fault::device);
    }
  }
  (void)second.next(evening_unix_s, 10);
}

TEST(RecordingFolder, SaysWhatStandsInTheWay) {
  const splid::test::TempFolder folder;
  const std::string file = folder.write("file", "");
  try {
    (void)Folder(file + "/below", 1000).next(0, 10);
    FAIL() << "made";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::device);
    EXPECT_THAT(error.what(), HasSubstr(file));
    EXPECT_THAT(error.what(), HasSubstr("record.folder"));
  }
}

}  // namespace
}  // namespace splid::recording
