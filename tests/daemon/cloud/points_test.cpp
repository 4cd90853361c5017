#include "daemon/cloud/points.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/support/error_text.hpp"

namespace splid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

PixelOptions pixel_at(const std::string& name, double azimuth_deg, double elevation_deg) {
  PixelOptions pixel;
  pixel.name = name;
  pixel.azimuth_deg = azimuth_deg;
  pixel.elevation_deg = elevation_deg;
  return pixel;
}

Config two_pixels() {
  Config config;
  config.file = "lab.json";
  config.pixels = {pixel_at("right", 30, 0), pixel_at("above", 0, 60)};
  return config;
}

FrameMessage frame_of(const std::string& pixel, FrameStatus status) {
  FrameMessage frame;
  frame.pixel = pixel;
  frame.status = status;
  frame.timestamp_s = 1767225600.125;
  frame.background_per_s = 5000;
  if (!frame.valid()) return frame;
  frame.distance_m = 10;
  frame.std_distance_m = 0.001;
  frame.velocity_mps = -1.5;
  frame.std_velocity_mps = 0.02;
  frame.signal_per_pulse = 0.01;
  frame.significance = 900;
  return frame;
}

std::vector<cloud::Point> points_of(cloud::Points& points, const FrameMessage& frame) {
  std::vector<cloud::Point> made;
  points.add(frame, [&made](const cloud::Point& point) { made.push_back(point); });
  return made;
}

void expect_at(const cloud::Point& point, double x, double y, double z) {
  EXPECT_NEAR(point.x, x, 1e-12);
  EXPECT_NEAR(point.y, y, 1e-12);
  EXPECT_NEAR(point.z, z, 1e-12);
}

TEST(CloudPoints, ArePlacedWithXAheadYToTheLeftAndZUp) {
  cloud::Points points(two_pixels());
  const auto right = points_of(points, frame_of("right", FrameStatus::ok));
  const auto above = points_of(points, frame_of("above", FrameStatus::ok));
  ASSERT_EQ(right.size(), 1U);
  ASSERT_EQ(above.size(), 1U);
  expect_at(right[0], 10 * std::sqrt(0.75), -5, 0);
  expect_at(above[0], 5, 0, 10 * std::sqrt(0.75));
  EXPECT_FALSE(std::signbit(above[0].y));
  EXPECT_EQ(right[0].pixel, 0U);
  EXPECT_EQ(above[0].pixel, 1U);
  EXPECT_EQ(above[0].radial_velocity, -1.5);
  EXPECT_EQ(above[0].std_radial_velocity, 0.02);
  EXPECT_EQ(above[0].std_distance, 0.001);
  EXPECT_EQ(above[0].signal_per_pulse, 0.01);
  EXPECT_EQ(above[0].background_per_s, 5000);
  EXPECT_EQ(above[0].significance, 900);
  EXPECT_EQ(above[0].time_s, 1767225600.125);
  EXPECT_EQ(points.left_out(), "");
}

TEST(CloudPoints, OfFramesThatAreNotValidAreLeftOutAndCounted) {
  cloud::Points points(two_pixels());
  EXPECT_EQ(points_of(points, frame_of("right", FrameStatus::no_target)).size(), 0U);
  EXPECT_EQ(points_of(points, frame_of("above", FrameStatus::no_target)).size(), 0U);
  EXPECT_EQ(points_of(points, frame_of("above", FrameStatus::saturated)).size(), 0U);
  EXPECT_EQ(points_of(points, frame_of("above", FrameStatus::ambiguous)).size(), 1U);
  EXPECT_EQ(points.left_out(), "2 no_target, 1 saturated");
  EXPECT_EQ(points.frames(), 4U);
  EXPECT_EQ(points.ambiguous(), 1U);
}

TEST(CloudPoints, AreOneForEachTargetOfAFrame) {
  cloud::Points points(two_pixels());
  FrameMessage frame = frame_of("right", FrameStatus::ok);
  FrameMessage::Target near, far;
  near.status = FrameStatus::ok;
  near.distance_m = 10;
  near.velocity_mps = -1.5;
  far = near;
  far.distance_m = 20;
  frame.targets = {near, far};
  const auto made = points_of(points, frame);
  ASSERT_EQ(made.size(), 2U);
  expect_at(made[0], 10 * std::sqrt(0.75), -5, 0);
  expect_at(made[1], 20 * std::sqrt(0.75), -10, 0);
  EXPECT_TRUE(std::isnan(made[1].std_radial_velocity));
  EXPECT_EQ(points.left_out(), "");
}

// The frames of a single pixel have no name.
TEST(CloudPoints, OfASinglePixelAreInItsDirection) {
  Config config = two_pixels();
  config.pixels.pop_back();
  cloud::Points points(config);
  const auto made = points_of(points, frame_of("", FrameStatus::ok));
  ASSERT_EQ(made.size(), 1U);
  expect_at(made[0], 10 * std::sqrt(0.75), -5, 0);
}

TEST(CloudPoints, WithoutDirectionsSayWhatToAdd) {
  Config config = two_pixels();
  config.pixels[1].elevation_deg.reset();
  EXPECT_THAT(test::error_text([&] { const cloud::Points points(config); }),
              AllOf(HasSubstr("lab.json: /pixels"), HasSubstr("pixel above has no elevation_deg"),
                    HasSubstr(R"({"input": 1, "azimuth_deg": 0, "elevation_deg": 0})")));
  config.pixels.clear();
  EXPECT_THAT(test::error_text([&] { const cloud::Points points(config); }),
              AllOf(HasSubstr("no list of pixels; set the angles of /scan for a scan"),
                    HasSubstr("channels.photon")));
}

Config scan() {
  Config config;
  config.file = "lab.json";
  config.frame.by = "line:1:2:64";
  config.scan.azimuth_deg = {-10, 10};
  return config;
}

FrameMessage dwell_at(std::optional<double> azimuth_deg, std::optional<double> elevation_deg) {
  FrameMessage frame = frame_of("", FrameStatus::ok);
  frame.scan = FrameMessage::Scan{0, 3, 5, azimuth_deg, elevation_deg};
  return frame;
}

TEST(CloudPoints, EachDwellOfAScanHasItsDirection) {
  cloud::Points points(scan());
  const auto right = points_of(points, dwell_at(30, std::nullopt));
  ASSERT_EQ(right.size(), 1U);
  expect_at(right[0], 10 * std::sqrt(0.75), -5, 0);
  expect_at(points_of(points, dwell_at(0, 60)).at(0), 5, 0, 10 * std::sqrt(0.75));
  EXPECT_TRUE(points_of(points, dwell_at(std::nullopt, std::nullopt)).empty());
  EXPECT_EQ(points.without_direction(), 1U);
  EXPECT_EQ(points.frames(), 3U);
}

TEST(CloudPoints, AScanWithoutDirectionsIsRefused) {
  Config config = scan();
  config.scan.azimuth_deg = {};
  const std::string needed = "lab.json: /scan: a cloud of a scan needs the directions";
  EXPECT_THAT(test::error_text([&] { cloud::Points{config}; }), HasSubstr(needed));
  Config told = two_pixels();  // only the recording tells that this is a scan
  told.pixels.resize(1);
  cloud::Points points(told);
  EXPECT_THAT(test::error_text([&] { points_of(points, dwell_at(1, 1)); }), HasSubstr(needed));
}

}  // namespace
}  // namespace splid
