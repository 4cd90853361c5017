#include "daemon/stream/scan_directions.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "tests/support/error_text.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid {
namespace {

using ::testing::HasSubstr;

ScanDirections directions_in(const test::TempFolder& folder, const std::string& text) {
  ScanOptions options;
  options.angles = folder.write("angles.csv", text);
  return ScanDirections(options);
}

ScanDirection at_tick(const ScanDirections& directions, double tick) {
  return directions.of({0, 0, 0, 1, tick});
}

TEST(ScanDirections, AScaleIsFromTheFirstToTheLast) {
  ScanOptions options;
  options.azimuth_deg = {-10, 20};
  options.elevation_deg = {5, -5};
  options.lines = 11;
  const ScanDirections directions(options);
  EXPECT_DOUBLE_EQ(*directions.of({0, 0, 0, 4}).azimuth_deg, -10);
  EXPECT_DOUBLE_EQ(*directions.of({0, 0, 3, 4}).azimuth_deg, 20);
  EXPECT_DOUBLE_EQ(*directions.of({0, 0, 0, 1}).azimuth_deg, -10);
  EXPECT_DOUBLE_EQ(*directions.of({0, 0, 0, 4}).elevation_deg, 5);
  EXPECT_DOUBLE_EQ(*directions.of({0, 10, 0, 4}).elevation_deg, -5);
  EXPECT_DOUBLE_EQ(*directions.of({0, 13, 0, 4}).elevation_deg, 3) << "a line too many is line 2";
  options.elevation_deg = {};
  EXPECT_FALSE(ScanDirections(options).of({}).elevation_deg);
}

TEST(ScanDirections, AnglesAreReadByTheTicks) {
  const test::TempFolder folder;
  const auto directions =
      directions_in(folder, "azimuth_deg,elevation_deg\n358, -1\n2,1\r\n\n10,1\n");
  EXPECT_DOUBLE_EQ(*at_tick(directions, 0).azimuth_deg, 358);
  EXPECT_DOUBLE_EQ(*at_tick(directions, 0.5).azimuth_deg, 360) << "the shorter way round";
  EXPECT_DOUBLE_EQ(*at_tick(directions, 0.5).elevation_deg, 0);
  EXPECT_DOUBLE_EQ(*at_tick(directions, 2).azimuth_deg, 10);
  EXPECT_FALSE(at_tick(directions, 2.1).azimuth_deg);
  EXPECT_FALSE(at_tick(directions, -0.1).azimuth_deg);
  EXPECT_FALSE(at_tick(directions, std::numeric_limits<double>::quiet_NaN()).elevation_deg);
}

TEST(ScanDirections, AFileThatHasNoAnglesIsRefused) {
  const test::TempFolder folder;
  const auto error = [&](const std::string& text) {
    return test::error_text([&] { (void)directions_in(folder, text); });
  };
  EXPECT_THAT(error(""), HasSubstr("has no angles"));
  EXPECT_THAT(error("1,2\n"), HasSubstr("line 1: 1,2 is not the first line azimuth_deg"));
  EXPECT_THAT(error("azimuth_deg,elevation_deg\n1,2\n1,x\n"),
              HasSubstr("line 3: 1,x is not two angles"));
  EXPECT_THAT(error("azimuth_deg,elevation_deg\n1,2,3\n"), HasSubstr("line 2: 1,2,3 is not two"));
}

}  // namespace
}  // namespace splid
