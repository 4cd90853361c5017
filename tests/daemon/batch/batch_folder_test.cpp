#include "daemon/batch/batch_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "protocol/frame_columns.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::batch {
namespace {

using ::testing::HasSubstr;

class BatchFolderTest : public ::testing::Test {
 protected:
  BatchFolderTest() {
    recording.file = folder.write("a.ptu", "a recording");
    recording.name = "day/a";
    recording.bytes = 11;
  }
  static std::string rows(std::size_t count) {
    std::string bytes;
    for (std::size_t i = 0; i < count; ++i) append_frame_row({}, bytes);
    return bytes;
  }

  test::TempFolder folder;
  Facts facts{"splid 1", R"({"frame":{"length_ms":50},"source":{}})", "{}", 1000};
  Recording recording;
  Folder output{folder.path("out")};
};

TEST_F(BatchFolderTest, KeepsSlicesAndFindsThemAgain) {
  output.write_slice(recording, "key", {12, 2}, rows(2));
  output.write_slice(recording, "key", {3, 1}, rows(1));
  const std::vector<SliceHead> slices = output.slices(recording, "key");
  ASSERT_EQ(slices.size(), 2U);
  EXPECT_EQ(slices[0].number, 3U);
  EXPECT_EQ(slices[1].number, 12U);
  EXPECT_EQ(slices[1].rows, 2U);
  EXPECT_EQ(output.slice_rows(recording, slices[1]), rows(2));
}

TEST_F(BatchFolderTest, ASliceOfAnotherKeyOrCutShortIsNone) {
  output.write_slice(recording, "key", {0, 2}, rows(2));
  EXPECT_TRUE(output.slices(recording, "other").empty());
  const std::string file = folder.path("out/slices/day/a/000000.slice");
  const auto bytes = std::filesystem::file_size(file);
  std::filesystem::resize_file(file, bytes - 1);
  EXPECT_TRUE(output.slices(recording, "key").empty());
  std::filesystem::resize_file(file, bytes);
  EXPECT_EQ(output.slices(recording, "key").size(), 1U);
  std::ofstream(file) << "damaged\n";
  EXPECT_TRUE(output.slices(recording, "key").empty());
}

TEST_F(BatchFolderTest, TheKeyIsThatOfTheRecordingAndOfTheFacts) {
  const std::string key = Folder::key_of(facts, recording);
  EXPECT_EQ(Folder::key_of(facts, recording), key);
  Facts others = facts;
  others.pattern_json = R"({"mode":"mrr"})";
  EXPECT_NE(Folder::key_of(others, recording), key);
  std::ofstream(recording.file) << "A recording";
  EXPECT_NE(Folder::key_of(facts, recording), key);
  recording.file = folder.path("none.ptu");
  EXPECT_THAT(test::error_text([this] { (void)Folder::key_of(facts, recording); }),
              HasSubstr("none.ptu: cannot open the recording: No such file"));
}

TEST_F(BatchFolderTest, GoesOnWithTheSameFactsAndAddsRecordings) {
  output.begin(facts, {recording});
  const std::string before = test::file_text(folder.path("out/batch.json"));
  output.begin(facts, {recording});
  EXPECT_EQ(test::file_text(folder.path("out/batch.json")), before);
  Recording other;
  other.file = "b.ptu";
  other.name = "b";
  output.begin(facts, {other});
  const std::vector<Recording> all = output.recordings();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].name, "day/a");
  EXPECT_EQ(all[0].file, recording.file);
  EXPECT_EQ(all[1].name, "b");
}

TEST_F(BatchFolderTest, RefusesFramesThatWereMeasuredByOtherFacts) {
  output.begin(facts, {recording});
  Facts others = facts;
  others.config_json = R"({"frame":{"length_ms":20},"source":{}})";
  EXPECT_THAT(test::error_text([&] { output.begin(others, {recording}); }),
              HasSubstr("with another configuration, which differs at /frame/length_ms; give "
                        "another folder"));
  others = facts;
  others.program = "splid 2";
  EXPECT_THAT(test::error_text([&] { output.begin(others, {recording}); }),
              HasSubstr("by splid 1 and not by splid 2"));
  others = facts;
  others.pattern_json = R"({"mode":"mrr"})";
  EXPECT_THAT(test::error_text([&] { output.begin(others, {recording}); }),
              HasSubstr("with another pattern"));
}

TEST_F(BatchFolderTest, RefusesAFolderOfOtherThings) {
  folder.write("out/thesis.tex", "mine");
  EXPECT_THAT(test::error_text([this] { output.begin(facts, {recording}); }),
              HasSubstr("has other things in it, such as thesis.tex"));
  EXPECT_THAT(test::error_text([this] { (void)output.recordings(); }),
              HasSubstr("there is no batch.json"));
}

}  // namespace
}  // namespace splid::batch
