#include "daemon/cloud/clouds.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>

#include "tests/support/error_text.hpp"
#include "tests/support/program.hpp"
#include "tests/support/some_points.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

using cloud::name_of_frame;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(Clouds, AreNamedByTheFramesNumberOrTime) {
  EXPECT_EQ(name_of_frame("a%d.bin", 12, 0), "a12.bin");
  EXPECT_EQ(name_of_frame("%06d-%t.bin", 12, 1767225600.125), "000012-1767225600125000.bin");
  EXPECT_EQ(name_of_frame("100%/a%x%5%.bin%", 12, 0), "100%/a%x%5%.bin%");
}

TEST(Clouds, AreOneForEachFrameThatHasPoints) {
  const test::TempFolder folder;
  const cloud::Point point = test::some_points()[0];
  cloud::Clouds clouds({folder.path("%d.xyzd"), false, "", 1000}, false);
  for (const std::uint64_t frame : {0, 0, 1, 7}) clouds.add(point, frame);
  clouds.finish();
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path(""))) {
    names.insert(entry.path().filename().string());
  }
  EXPECT_THAT(names, ElementsAre("0.xyzd", "1.xyzd", "7.xyzd"));
  const std::string line = "284.500000 -12.250000 3.500000 -1.500000\n";
  EXPECT_EQ(test::file_text(folder.path("0.xyzd")), line + line);
  EXPECT_EQ(test::file_text(folder.path("7.xyzd")), line);
  EXPECT_EQ(clouds.points(), 4U);
  EXPECT_EQ(clouds.files(), 3U);
}

TEST(Clouds, DoNotReplaceWhatIsThere) {
  const test::TempFolder folder;
  folder.write("1.xyzd", "mine");
  const cloud::FormatOptions options{folder.path("%d.xyzd"), false, "", 1000};
  cloud::Clouds clouds(options, false);
  EXPECT_THAT(test::error_text([&] { clouds.add(test::some_points()[0], 1); }),
              HasSubstr("1.xyzd: exists; --force"));
  cloud::Clouds forced(options, true);
  forced.add(test::some_points()[0], 1);
  forced.finish();
  EXPECT_THAT(test::file_text(folder.path("1.xyzd")), HasSubstr("284.5"));
}

}  // namespace
}  // namespace splid
