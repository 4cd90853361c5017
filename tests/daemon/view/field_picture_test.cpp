#include "daemon/view/field_picture.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace splid::view {
namespace {

using ::testing::ElementsAre;

constexpr std::size_t wide_terminal = 1000;  // columns

SceneMessage::Pixel pixel_of(const std::string& name, double distance_m, double velocity_mps) {
  SceneMessage::Pixel pixel;
  pixel.name = name;
  pixel.frame.status = FrameStatus::ok;
  pixel.frame.distance_m = distance_m;
  pixel.frame.velocity_mps = velocity_mps;
  return pixel;
}

SceneMessage four_pixels() {
  SceneMessage scene;
  scene.whole.timestamp_s = 3725.25;
  scene.pixels = {pixel_of("a", 20, 1.2), pixel_of("b", 25, 0), pixel_of("c", 27, 0), {}};
  scene.pixels[3].name = "d";
  scene.pixels[3].frame.status = FrameStatus::no_target;
  return scene;
}

// Not in the order of the grid: c and d are above a and b.
SceneMessage four_in_a_grid() {
  SceneMessage scene = four_pixels();
  for (std::size_t i = 0; i < 4; ++i) {
    scene.pixels[i].azimuth_deg = i % 2 == 0 ? -0.1 : 0.1;
    scene.pixels[i].elevation_deg = i < 2 ? -0.1 : 0.1;
  }
  return scene;
}

TEST(FieldPicture, IsAPictureWhereDirectionsFormAGrid) {
  const SceneMessage scene = four_in_a_grid();
  EXPECT_THAT(field_lines(scene, Characters::ascii, wide_terminal),
              ElementsAre("01:02:05.250  3 ok, 1 no_target; range 20.0000 _ to 27.0000 # m; "
                          "velocity 0.0000 _ to 1.2000 # m/s",
                          "  ##.     __. ", "  __++    ##__"));
  EXPECT_THAT(field_lines(scene, Characters::utf8, wide_terminal)[2], "  ▁▁▆▆    ██▁▁");
}

TEST(FieldPicture, HasNarrowPixelsWhereTheTerminalIsNarrow) {
  SceneMessage scene = four_in_a_grid();
  EXPECT_EQ(field_lines(scene, Characters::ascii, 14)[1], "  ##.     __. ");
  EXPECT_EQ(field_lines(scene, Characters::ascii, 13)[1], "  #.    _.");
}

TEST(FieldPicture, IsATableWhereThereIsNoGrid) {
  SceneMessage scene = four_pixels();
  scene.pixels[0].frame.std_distance_m = 0.0006;
  EXPECT_THAT(
      field_lines(scene, Characters::utf8, wide_terminal),
      ElementsAre("01:02:05.250  3 ok, 1 no_target",
                  "pixel       distance m  +- mm   velocity m/s +- cm/s   S/pulse  status",
                  "a             20.00000   0.60         1.2000       -         -  ok",
                  "b             25.00000      -         0.0000       -         -  ok",
                  "c             27.00000      -         0.0000       -         -  ok",
                  "d                    -      -              -       -         -  no_target"));
}

TEST(FieldPicture, IsATableWhereTwoPixelsHaveOneDirection) {
  SceneMessage scene = four_pixels();
  for (auto& pixel : scene.pixels) pixel.azimuth_deg = pixel.elevation_deg = 0;
  EXPECT_EQ(field_lines(scene, Characters::utf8, wide_terminal).size(), 6U);
}

}  // namespace
}  // namespace splid::view
