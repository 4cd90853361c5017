#include "daemon/cloud/encoding.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <string>

#include "tests/support/error_text.hpp"
#include "tests/support/some_points.hpp"

namespace splid {
namespace {

using ::testing::HasSubstr;

std::string refusal(const cloud::FormatOptions& options) {
  return test::error_text([&] { (void)cloud::make_encoding(options); });
}

TEST(CloudEncoding, IsThatOfTheFilesName) {
  EXPECT_EQ(refusal({"a.pcd", true, "", 1e3}), "");
  EXPECT_EQ(refusal({"a.ply", true, "", 1e3}), "");
  EXPECT_EQ(refusal({"a.las", false, "", 1e3}), "");
  EXPECT_EQ(refusal({"a.xyzd", false, "", 1e3}), "");
  EXPECT_EQ(refusal({"a.bin", false, "boreas", 1e3}), "");
  EXPECT_THAT(refusal({"a.laz", false, "", 1e3}), HasSubstr("--output a.laz: a cloud's name ends"));
  EXPECT_THAT(refusal({"a.las", true, "", 1e3}), HasSubstr("--ascii is for .pcd and .ply"));
  EXPECT_THAT(refusal({"a.pcd", false, "dicp", 1e3}), HasSubstr("--layout is for .bin"));
  EXPECT_THAT(refusal({"a.bin", false, "", 1e3}), HasSubstr("--layout is missing"));
}

// The head is written again over itself once the points are counted.
TEST(CloudEncoding, HasAHeadOfOneSizeForAnyCloud) {
  cloud::Summary most;
  most.points = std::numeric_limits<std::uint64_t>::max();
  most.first_time_s = 1767225600.125;
  most.least = {-1e5, -1e5, -1e5};
  for (const char* name : {"a.pcd", "a.ply", "a.las", "a.xyzd"}) {
    const auto encoding = cloud::make_encoding({name, false, "", 1e3});
    EXPECT_EQ(encoding->head({}).size(), encoding->head(most).size()) << name;
  }
}

TEST(CloudSummary, HasTheBoxAndTheFirstTime) {
  cloud::Summary summary;
  for (const cloud::Point& point : test::some_points()) summary.add(point);
  EXPECT_EQ(summary.points, 2U);
  EXPECT_EQ(summary.first_time_s, 1767225600.125);
  EXPECT_THAT(summary.least, testing::ElementsAre(-2.75, -12.25, 0.125));
  EXPECT_THAT(summary.most, testing::ElementsAre(284.5, 0.5, 3.5));
}

}  // namespace
}  // namespace splid
