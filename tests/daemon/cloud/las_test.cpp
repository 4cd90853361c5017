#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "daemon/cloud/encoding.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/las_reader.hpp"
#include "tests/support/some_points.hpp"

namespace splid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

test::LasReader read(double largest_range_m, const std::vector<cloud::Point>& points) {
  return test::LasReader(test::encoded(*cloud::las_encoding(largest_range_m), points));
}

TEST(Las, HasTheCountsTheBoxAndTheDay) {
  const test::LasReader las = read(1000, test::some_points());
  EXPECT_THAT(las.software(), StartsWith("splid "));
  EXPECT_EQ(las.year(), 2026U);
  EXPECT_EQ(las.day(), 1U);
  EXPECT_EQ(las.count(), 2U);
  EXPECT_EQ(las.count_of_return(1), 2U);
  EXPECT_EQ(las.count_of_return(2), 0U);
  EXPECT_EQ(las.scale(), 1e-4);
  for (const auto& [axis, least, most] :
       {std::tuple{0, -2.75, 284.5}, {1, -12.25, 0.5}, {2, 0.125, 3.5}}) {
    EXPECT_NEAR(las.least(static_cast<std::size_t>(axis)), least, 1e-9);
    EXPECT_NEAR(las.most(static_cast<std::size_t>(axis)), most, 1e-9);
  }
}

TEST(Las, SaysWhatItsValuesAre) {
  const test::LasReader las = read(1000, test::some_points());
  ASSERT_EQ(las.records.size(), 2U);
  EXPECT_EQ(las.records[0].id, 3U);
  EXPECT_THAT(las.records[0].text, HasSubstr("radial_velocity in m/s, receding positive"));
  std::vector<std::string> names;
  for (const auto& extra : las.extras) names.push_back(extra.name);
  EXPECT_THAT(names, ElementsAre("radial_velocity", "std_radial_velocity", "std_distance",
                                 "signal_per_pulse", "background_per_s", "significance", "pixel"));
  EXPECT_EQ(las.extras[0].description, "m/s, receding positive");
}

TEST(Las, HasAllValuesOfAPoint) {
  const test::LasReader las = read(1000, test::some_points());
  ASSERT_EQ(las.points.size(), 2U);
  const auto& first = las.points[0];
  EXPECT_NEAR(first.place[0], 284.5, 1e-9);
  EXPECT_NEAR(first.place[1], -12.25, 1e-9);
  EXPECT_NEAR(first.place[2], 3.5, 1e-9);
  EXPECT_EQ(first.intensity, std::lround(65535 * 0.0125));
  EXPECT_EQ(first.return_number, 1U);
  EXPECT_EQ(first.returns, 1U);
  EXPECT_TRUE(las.gps_time_is_adjusted());
  // 2026-01-01 is 16,797 days after 1980-01-06, and GPS time is 18 s ahead of UTC.
  EXPECT_NEAR(first.gps_time, 16797.0 * 86400 + 18 + 0.125 - 1e9, 1e-6);
  EXPECT_EQ(first.extra.at("radial_velocity"), -1.5);
  EXPECT_EQ(first.extra.at("std_radial_velocity"), 0.0625);
  EXPECT_EQ(first.extra.at("std_distance"), static_cast<double>(0.0005F));
  EXPECT_EQ(first.extra.at("background_per_s"), 62500);
  EXPECT_EQ(first.extra.at("significance"), 800.5);
  EXPECT_TRUE(std::isnan(las.points[1].extra.at("std_radial_velocity")));
  EXPECT_EQ(las.points[1].intensity, 65535U) << "of more than one detection in a pulse";
  EXPECT_EQ(las.points[1].extra.at("pixel"), 4e9);
}

TEST(Las, TakesALargerStepWhereThePatternCanTellMore) {
  std::vector<cloud::Point> points = test::some_points();
  points[0].x = 400'000.0123;
  const test::LasReader las = read(500'000, points);
  EXPECT_EQ(las.scale(), 1e-3);
  EXPECT_NEAR(las.points[0].place[0], 400'000.012, 1e-9);
  EXPECT_THAT(test::error_text([&] { (void)read(1000, points); }),
              HasSubstr("a point at 400000.0123 m is beyond the 214748.3647 m"));
}

}  // namespace
}  // namespace splid
