#include "drivers/simulator/surface.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "drivers/simulator/array_pixels.hpp"
#include "protocol/error.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::simulator {
namespace {

using ::testing::HasSubstr;

constexpr double degree = 0.017453292519943295;

Plane moving_plane() {
  Plane plane;
  plane.path.motion = MotionKind::linear;
  plane.path.distance_m = 10;
  plane.path.velocity_mps = -2;
  return plane;
}

TEST(Plane, IsMetAlongTheLineOfSight) {
  const Meeting met = moving_plane().meet({3, -4}).value();
  const double factor = 1 / (std::cos(3 * degree) * std::cos(4 * degree));
  EXPECT_NEAR(met.path.distance_m, 10 * factor, 1e-12);
  EXPECT_NEAR(met.path.velocity_mps, -2 * factor, 1e-12);
}

// The point that is met lies on the plane.
TEST(Plane, TiltMakesARamp) {
  Plane plane = moving_plane();
  plane.tilt_azimuth_deg = 30;
  plane.tilt_elevation_deg = -20;
  const double z = plane.meet({5, 7}).value().path.distance_m;
  const double ahead = z * std::cos(7 * degree) * std::cos(5 * degree);
  const double right = z * std::cos(7 * degree) * std::sin(5 * degree);
  const double up = z * std::sin(7 * degree);
  EXPECT_NEAR(ahead, 10 + right * std::tan(30 * degree) + up * std::tan(-20 * degree), 1e-12);
  plane.tilt_azimuth_deg = 88;
  EXPECT_FALSE(plane.meet({5, 7}));
}

TEST(Plane, FillsItsFieldAlone) {
  Plane plane = moving_plane();
  plane.field = {{-1, 2}, {}};
  EXPECT_TRUE(plane.meet({2, 60}));
  EXPECT_FALSE(plane.meet({2.01, 0}));
  plane.field = {{2, -1}, {}};
  EXPECT_EQ(plane.validate().value().pointer, "/azimuth_deg");
}

class Pictures : public ::testing::Test {
 protected:
  test::TempFolder folder_;
};

TEST_F(Pictures, GiveDistanceAndVelocity) {
  PictureOptions options;
  options.distance = folder_.write("d.pgm", "P2\n# by hand\n3 2\n1000\n100 200 300\n0 500 1000\n");
  options.velocity =
      folder_.write("v.pgm", std::string("P5 3 2 65535 \0\0\0\1\0\2\1\0\1\1\1\2", 25));
  options.distance_m = 5;
  options.distance_step_m = 0.01;
  options.velocity_mps = -1;
  options.velocity_step_mps = 0.01;
  options.field = {{-3, 3}, {-2, 2}};
  ASSERT_FALSE(options.validate());
  const PictureSurface surface(options);
  const auto right_below = surface.meet({2.9, -1.9});
  ASSERT_TRUE(right_below);
  EXPECT_NEAR(right_below->path.distance_m, 15, 1e-12);
  EXPECT_NEAR(right_below->path.velocity_mps, -1 + 2.58, 1e-12);
  const auto left_above = surface.meet({-3, 2});
  ASSERT_TRUE(left_above);
  EXPECT_NEAR(left_above->path.distance_m, 6, 1e-12);
  EXPECT_NEAR(left_above->path.velocity_mps, -1, 1e-12);
  EXPECT_FALSE(surface.meet({-2.9, -1.9}));  // no target
  EXPECT_FALSE(surface.meet({3.1, 0}));
}

TEST_F(Pictures, ThatCannotBeReadAreRefused) {
  const auto error_of = [&](const std::string& content) {
    const std::string file = folder_.write("bad.pgm", content);
    return test::error_text([&] { read_pgm(file); });
  };
  EXPECT_THAT(error_of("P6 1 1 255 a"), HasSubstr("bad.pgm: is no PGM picture"));
  EXPECT_THAT(error_of("P5 2 1 255 a"), HasSubstr("ends before its last value"));
  EXPECT_THAT(error_of("P5 0 1 255 a"), HasSubstr("the width of the picture"));
  EXPECT_THAT(error_of("P5 1 1 65536 a"), HasSubstr("the white of the picture"));
  EXPECT_THAT(error_of("P5 1 1 9 a"), HasSubstr("a value above its white"));
  EXPECT_THAT(test::error_text([&] { read_pgm(folder_.path("none.pgm")); }),
              HasSubstr("none.pgm: cannot be read"));
  PictureOptions options;
  options.distance = folder_.write("d.pgm", "P2 1 1 9 1");
  options.velocity = folder_.write("v.pgm", "P2 1 2 9 1 1");
  EXPECT_THAT(test::error_text([&] { PictureSurface{options}; }),
              HasSubstr("v.pgm: has 1 x 2 points"));
}

// A plate before a wall, in the middle column of three.
TEST(ArrayPixels, LookAtTheNearestSurface) {
  Options options;
  options.array.columns = 3;
  options.array.rows = 2;
  options.array.pitch_deg = 1;
  Plane wall = moving_plane();
  wall.path.distance_m = 20;
  wall.path.velocity_mps = 0;
  wall.field = {{-0.5, 5}, {}};
  Plane plate = moving_plane();
  plate.field = {{-0.5, 0.5}, {}};
  plate.signal_per_pulse = 4e-4;
  options.array.planes = {plate, wall};
  options.array.inputs.resize(1);
  options.array.inputs[0].input = 6;
  options.array.inputs[0].dark_per_s = 7;
  options.array.inputs[0].distance_m = 3;
  options.array.inputs[0].velocity_mps = 1;
  const std::vector<ArrayPixel> pixels = array_pixels(options);
  ASSERT_EQ(pixels.size(), 6U);
  EXPECT_EQ(pixels[0].scene.detection.signal_per_pulse, 0);
  EXPECT_EQ(pixels[1].scene.detection.signal_per_pulse, 4e-4);
  EXPECT_NEAR(pixels[1].scene.target.velocity_mps, -2, 1e-3);
  EXPECT_EQ(pixels[2].scene.detection.signal_per_pulse, 13.5e-4);
  EXPECT_NEAR(pixels[2].scene.target.distance_m, 20, 1e-2);
  EXPECT_EQ(pixels[5].scene.target.distance_m, 3);
  EXPECT_EQ(pixels[5].scene.target.velocity_mps, 1);
  EXPECT_EQ(pixels[5].scene.dark_per_s, 7);
  EXPECT_EQ(pixels[5].scene.photon_input, 6);
  EXPECT_EQ(pixels[0].direction.azimuth_deg, -1);
  EXPECT_EQ(pixels[0].direction.elevation_deg, 0.5);
  EXPECT_EQ(pixels[5].direction.azimuth_deg, 1);
  EXPECT_EQ(pixels[5].direction.elevation_deg, -0.5);
}

TEST(ArrayOptions, FaultsNameTheirPlace) {
  Options options;
  options.array.columns = 2;
  options.array.inputs.resize(1);
  options.array.inputs[0].input = 3;
  EXPECT_EQ(options.validate().value().pointer, "/array/inputs/0/input");
  options.array.inputs.clear();
  options.detector.inputs = 2;
  EXPECT_EQ(options.validate().value().pointer, "/detector/inputs");
  options.detector.inputs = 1;
  options.array.planes.resize(2);
  options.array.planes[1].path.motion = MotionKind::points;
  EXPECT_EQ(options.validate().value().pointer, "/array/planes/1/points");
  options.array.planes.clear();
  options.array.picture.velocity = "v.pgm";
  EXPECT_EQ(options.validate().value().pointer, "/array/picture/velocity");
  options.array.picture.distance = "/none/d.pgm";
  EXPECT_EQ(options.start_fault().value().pointer, "/array/picture");
}

}  // namespace
}  // namespace splid::simulator
