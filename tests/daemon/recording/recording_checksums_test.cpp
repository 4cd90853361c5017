#include "daemon/recording/recording_checksums.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/program.hpp"

namespace splid::recording {
namespace {

using test::file_text;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class RecordingChecksumsTest : public ::testing::Test {
 protected:
  // A table in folder/NAME.csv.
  std::unique_ptr<FrameTable> table(const std::string& name) {
    return std::make_unique<FrameTable>(folder.path(name + ".csv"),
                                        TableFacts{"splid", "{}", "{}", name}, false);
  }
  std::string facts_of(const std::string& name) {
    return file_text(folder.path(name + ".csv.facts.json"));
  }

  test::TempFolder folder;
  std::vector<std::string> said;  // by one thread at a time
  std::function<void(const std::string&)> say = [this](const std::string& sentence) {
    said.push_back(sentence);
  };
};

TEST_F(RecordingChecksumsTest, EachTableGetsItsRecordings) {
  Checksums checksums(say);
  checksums.add(table("a"), folder.write("a", "abc"));
  checksums.add(table("b"), folder.write("b", ""));
  checksums.finish({});
  EXPECT_THAT(facts_of("a"), HasSubstr("\"ba7816bf8f01cfea"));
  EXPECT_THAT(facts_of("b"), HasSubstr("\"e3b0c44298fc1c14"));
  EXPECT_THAT(said, IsEmpty());
}

TEST_F(RecordingChecksumsTest, ARecordingThatWasRemovedIsPassedOver) {
  Checksums checksums(say);
  checksums.add(table("a"), folder.path("a"));
  checksums.finish({});
  EXPECT_THAT(facts_of("a"), HasSubstr("\"recording_sha256\":\"\""));
  EXPECT_THAT(said, IsEmpty());
}

// A terabyte, which takes no room, is not read in the time that a service may take to end.
TEST_F(RecordingChecksumsTest, WhatIsNotReadInTimeIsSaid) {
  const std::string large = folder.write("large", "");
  std::filesystem::resize_file(large, std::uintmax_t{1} << 40U);
  {
    Checksums checksums(say);
    checksums.add(table("a"), large);
    checksums.add(table("b"), folder.write("b", "abc"));
    checksums.finish({}, std::chrono::milliseconds{1});
  }
  EXPECT_THAT(said, ElementsAre(HasSubstr("the table of " + large + " stays without"),
                                HasSubstr("sha256sum prints it")));
  EXPECT_THAT(facts_of("a"), HasSubstr("\"recording_sha256\":\"\""));
  said.clear();
  std::stop_source stop;
  stop.request_stop();
  Checksums checksums(say);
  checksums.add(table("c"), large);
  checksums.finish(stop.get_token());
  EXPECT_THAT(said, ElementsAre(HasSubstr(large)));
}

TEST_F(RecordingChecksumsTest, NoMoreThan64Wait) {
  const std::string large = folder.write("large", "");
  std::filesystem::resize_file(large, std::uintmax_t{1} << 40U);
  Checksums checksums(say);
  checksums.add(table("large"), large);
  for (int i = 0; i < 65; ++i) {
    const std::string name = std::to_string(i);
    checksums.add(table(name), folder.write(name, "abc"));
  }
  EXPECT_THAT(said, ElementsAre(HasSubstr(folder.path("0") + " stays"),
                                HasSubstr(folder.path("1") + " stays")));
  checksums.finish({}, std::chrono::milliseconds{1});
  EXPECT_EQ(said.size(), 66U);
}

}  // namespace
}  // namespace splid::recording
