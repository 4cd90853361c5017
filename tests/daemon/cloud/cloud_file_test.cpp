#include "daemon/cloud/cloud_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/support/allocation_count.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/las_reader.hpp"
#include "tests/support/program.hpp"
#include "tests/support/some_points.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

using ::testing::HasSubstr;

TEST(CloudFile, HasItsNameOnceItIsWhole) {
  const test::TempFolder folder;
  const std::string name = folder.write("a.las", "the cloud before");
  {
    cloud::File file(name, cloud::las_encoding(1000));
    for (const cloud::Point& point : test::some_points()) file.add(point);
    EXPECT_EQ(test::file_text(name), "the cloud before");
    file.finish();
    EXPECT_EQ(file.points(), 2U);
  }
  EXPECT_EQ(test::file_text(name), test::encoded(*cloud::las_encoding(1000), test::some_points()));
  EXPECT_FALSE(std::filesystem::exists(name + ".part"));
}

TEST(CloudFile, ThatIsNotFinishedLeavesNothing) {
  const test::TempFolder folder;
  {
    cloud::File file(folder.path("a.pcd"), cloud::pcd_encoding(false));
    file.add(test::some_points()[0]);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path("")));
}

TEST(CloudFile, ThatCannotBeWrittenSaysWhy) {
  EXPECT_THAT(test::error_text([] { cloud::File("/no/a.pcd", cloud::pcd_encoding(false)); }),
              HasSubstr("/no/a.pcd: cannot be written: No such file or directory"));
}

// Ten million points take as much memory as a few; so many are written where there is time.
TEST(CloudFile, TakesNoMemoryForItsPoints) {
  const test::TempFolder folder;
  const bool is_long = std::getenv("SPLID_LONG_TESTS") != nullptr;
  const std::uint64_t count = is_long ? 10'000'000 : 20'000;
  for (const bool ascii : {false, true}) {
    const std::string name = folder.path("a.pcd");
    cloud::File file(name, cloud::pcd_encoding(ascii));
    const cloud::Point point = test::some_points()[0];
    const std::uint64_t before = test::allocations.load();
    for (std::uint64_t i = 0; i < count; ++i) file.add(point);
    EXPECT_EQ(test::allocations.load(), before);
    file.finish();
    const auto encoding = cloud::pcd_encoding(ascii);
    std::string row;
    encoding->append(point, {}, row);
    EXPECT_EQ(std::filesystem::file_size(name), encoding->head({}).size() + count * row.size());
  }
}

}  // namespace
}  // namespace splid
