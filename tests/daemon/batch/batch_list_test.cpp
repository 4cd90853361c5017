#include "daemon/batch/batch_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::batch {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(BatchList, HasTheRecordingsOfFoldersSortedAndThoseThatAreNamed) {
  const test::TempFolder folder;
  folder.write("week/b/run.ptu", "123");
  folder.write("week/a/run.ptu", "12");
  folder.write("week/notes.txt", "no recording");
  const std::string single = folder.write("single.ptu", "1");
  const auto found = find_recordings({folder.path("week"), single, folder.path("none.ptu")});
  ASSERT_EQ(found.size(), 4U);
  EXPECT_EQ(found[0].name, "a/run");
  EXPECT_EQ(found[0].file, folder.path("week/a/run.ptu"));
  EXPECT_EQ(found[1].name, "b/run");
  EXPECT_EQ(found[1].begin, 2U);
  EXPECT_EQ(found[2].name, "single");
  EXPECT_EQ(found[2].begin, 5U);
  EXPECT_EQ(found[3].name, "none");  // it is named where it fails
  EXPECT_EQ(bytes_of(found), 7U);
}

TEST(BatchList, RefusesFoldersWithoutRecordingsAndTwoRecordingsOfOneTable) {
  const test::TempFolder folder;
  folder.write("empty/notes.txt", "no recording");
  EXPECT_THAT(
      test::error_text([&] { find_recordings({folder.path("empty")}); }),
      HasSubstr("there is no recording in this folder or below it (splid looks for *.ptu, *.pt2"));
  const std::string a = folder.write("a/run.ptu", "1");
  const std::string b = folder.write("b/run.ptu", "1");
  EXPECT_THAT(test::error_text([&] {
                find_recordings({a, b});
              }),
              AllOf(HasSubstr(a), HasSubstr(b), HasSubstr("run.h5")));
}

TEST(BatchList, AShardIsAnIndexFromOneAndACount) {
  EXPECT_EQ(shard_of("3/7").index, 3U);
  EXPECT_EQ(shard_of("3/7").count, 7U);
  EXPECT_EQ(shard_of("1/1").count, 1U);
  for (const char* text : {"0/7", "8/7", "3", "3/", "/7", "a/7", "3/7/", "-1/7", ""}) {
    EXPECT_THAT(test::error_text([text] { shard_of(text); }), HasSubstr("must be i/N")) << text;
  }
}

// Every byte of every recording is in the part of one shard.
TEST(BatchList, ThePartsOfAllShardsAreTheWhole) {
  std::vector<Recording> recordings(4);
  const std::vector<std::uint64_t> lengths = {1, 1000, 3, 37};
  std::uint64_t begin = 0;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    recordings[i].bytes = lengths[i];
    recordings[i].begin = begin;
    begin += lengths[i];
  }
  for (const std::uint64_t count : {1U, 2U, 7U, 40U, 5000U}) {
    for (const Recording& recording : recordings) {
      std::uint64_t reached = 0;
      for (std::uint64_t index = 1; index <= count; ++index) {
        const Part part = part_of({index, count}, recording, begin);
        if (part.bytes() == 0) continue;
        ASSERT_EQ(part.begin, reached) << index << "/" << count;
        reached = part.end;
      }
      EXPECT_EQ(reached, recording.bytes) << count;
    }
  }
}

TEST(BatchList, SharesAreEvenAlsoOfAPetabyte) {
  Recording recording;
  recording.bytes = std::uint64_t{1} << 60U;
  const Part part = part_of({99'999, 100'000}, recording, recording.bytes);
  EXPECT_NEAR(static_cast<double>(part.bytes()), static_cast<double>(recording.bytes) / 1e5, 2);
}

}  // namespace
}  // namespace splid::batch
