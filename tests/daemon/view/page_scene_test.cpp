#include "daemon/view/page_scene.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "protocol/json_value.hpp"

namespace splid::view {
namespace {

SceneMessage::Pixel page_pixel(const std::string& name, FrameStatus status, double value) {
  SceneMessage::Pixel pixel;
  pixel.name = name;
  pixel.frame.status = status;
  pixel.frame.distance_m = pixel.frame.velocity_mps = pixel.frame.signal_per_pulse = value;
  return pixel;
}

TEST(PageScene, APixelThatIsNotValidHasNoValueToDraw) {
  SceneMessage scene;
  scene.whole.timestamp_s = 12.5;
  scene.whole.sequence = 7;
  scene.pixels = {page_pixel("a", FrameStatus::ok, 20.123456789012),
                  page_pixel("b", FrameStatus::saturated, 21),
                  page_pixel("c", FrameStatus::ambiguous, 22),
                  page_pixel("d", FrameStatus::ok, std::numeric_limits<double>::infinity())};
  scene.pixels[2].frame.velocity_mps.reset();
  EXPECT_EQ(picture_json(scene), R"({"timestamp":12.5,"sequence":7,"status":[1,6,3,1],)"
                                 R"("distance_m":[20.1234568,null,22,null],)"
                                 R"("velocity_mps":[20.1234568,null,null,null],)"
                                 R"("signal_per_pulse":[20.1234568,null,22,null]})");
}

TEST(PageScene, PixelsStandByTheirDirectionsOrInTheirOrder) {
  std::vector<SceneMessage::Pixel> pixels(5);
  for (std::size_t i = 0; i < 5; ++i) pixels[i].name = std::string(1, static_cast<char>('a' + i));
  EXPECT_EQ(layout_json(pixels), R"({"is_grid":false,"columns":3,"rows":2,)"
                                 R"("pixel":["a","b","c","d","e"],"cell":[0,1,2,3,4]})");
  for (std::size_t i = 0; i < 5; ++i) {
    pixels[i].azimuth_deg = -static_cast<double>(i);
    pixels[i].elevation_deg = 0;
  }
  EXPECT_EQ(layout_json(pixels), R"({"is_grid":true,"columns":5,"rows":1,)"
                                 R"("pixel":["a","b","c","d","e"],"cell":[4,3,2,1,0]})");
}

}  // namespace
}  // namespace splid::view
