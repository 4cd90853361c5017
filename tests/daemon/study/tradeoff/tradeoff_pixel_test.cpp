#include "daemon/study/tradeoff/tradeoff_pixel.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "daemon/study/tradeoff/tradeoff_frames.hpp"
#include "protocol/error.hpp"
#include "tests/support/daemon_scene.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/field_scene.hpp"

namespace splid::tradeoff {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A simulated array of four columns and three rows. Input 6 looks at a wall of its own.
Config field_config(bool pool = false) {
  std::vector<PixelOptions> pixels = test::pixels_of(12);
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    pixels[p].azimuth_deg = 0.1 * static_cast<double>(p % 4);
    pixels[p].elevation_deg = -0.1 * static_cast<double>(p / 4);
  }
  pixels[5].delay_ps = 250;
  Config config = test::with_pixels(scene_config(1), std::move(pixels));
  auto& scene = dynamic_cast<simulator::Options&>(*config.source);
  scene.array.columns = 4;
  scene.array.rows = 3;
  simulator::Plane wall;
  wall.path.motion = simulator::MotionKind::linear;
  wall.path.distance_m = 30;
  wall.path.velocity_mps = -1;
  scene.array.planes = {wall};
  simulator::ArrayInput own;
  own.input = 6;
  own.delay_ps = 250;
  own.distance_m = 20;
  own.velocity_mps = 2;
  scene.array.inputs = {own};
  config.scene.pool = pool;
  return config;
}

std::vector<KeptFrame> frames_of(const Config& config) {
  return collect_frames(config, find_origin(config, ""), 10, 5, [](std::size_t) {}, {});
}

TEST(TradeoffPixel, IsMeasuredByAConfigurationOfItsOwn) {
  Config config = field_config();
  config.scene.rigid = true;
  for (PixelOptions& pixel : config.pixels) pixel.sigma_ps = 130;
  for (PixelOptions& pixel : config.pixels) pixel.dead_time_ns = 22;
  const Config one = config_of_pixel(std::move(config), "6");
  EXPECT_THAT(one.channels.photon, ElementsAre("6"));
  EXPECT_THAT(one.channels.delays_ps, ElementsAre(250));
  EXPECT_THAT(one.channels.pixels, IsEmpty());
  EXPECT_THAT(one.pixels, IsEmpty());
  EXPECT_EQ(one.pulse.sigma_ps, 130);
  EXPECT_EQ(one.detector.dead_time_ns, 22);
  EXPECT_FALSE(one.scene.rigid);
  EXPECT_THAT(config_of_pixel(field_config(), "").channels.photon, ElementsAre("1"));
}

TEST(TradeoffPixel, IsPooledWithThoseAroundIt) {
  const Config one = config_of_pixel(field_config(true), "1");
  EXPECT_EQ(one.channels.photon.front(), "1");
  EXPECT_THAT(one.channels.photon, ::testing::UnorderedElementsAre("1", "2", "5", "6"));
  EXPECT_THAT(one.channels.delays_ps, ::testing::UnorderedElementsAre(0, 0, 0, 250));
  EXPECT_FALSE(one.scene.pool);
}

TEST(TradeoffPixel, OfAnotherNameIsRefused) {
  EXPECT_THAT(test::error_text([] { config_of_pixel(field_config(), "a1"); }),
              AllOf(HasSubstr("--pixel a1"), HasSubstr("scene.json"), HasSubstr("such as 1")));
  EXPECT_THAT(test::error_text([] { config_of_pixel(scene_config(1), "a1"); }),
              HasSubstr("/pixels"));
  EXPECT_EQ(config_of_pixel(scene_config(1), "").channels.photon, scene_config(1).channels.photon);
  Config config = field_config(true);
  config.pixels[3].azimuth_deg.reset();
  EXPECT_THAT(test::error_text([&] { config_of_pixel(std::move(config), ""); }),
              HasSubstr("azimuth_deg"));
}

TEST(TradeoffPixel, HasTheFramesAndTheTruthOfItsInput) {
  const FrameOrigin origin = find_origin(config_of_pixel(field_config(), "6"), "");
  EXPECT_EQ(origin.scene->target.distance_m, 20);
  const std::vector<KeptFrame> frames = frames_of(config_of_pixel(field_config(), "6"));
  ASSERT_EQ(frames.size(), 6U);
  for (const KeptFrame& frame : frames) {
    EXPECT_NEAR(static_cast<double>(frame.photons_ps.size()), 1893, 5 * 44);
    EXPECT_EQ(frame.truth->velocity_mps, 2);
    EXPECT_NEAR(frame.truth->delay_ns, 2 * 20.06 / 0.299792458, 1);
  }
}

// The rates are those of nine pixels; distance and velocity those of the pixel itself.
TEST(TradeoffPixel, HasTheTruthOfThePool) {
  const Config one = config_of_pixel(field_config(true), "6");
  ASSERT_EQ(one.channels.photon.size(), 9U);
  const FrameOrigin origin = find_origin(one, "");
  EXPECT_NEAR(origin.truth->signal_per_pulse, 9 * 13.5e-4, 1e-9);
  EXPECT_NEAR(origin.truth->background_per_s, 9 * 175'000, 1e-6);
  EXPECT_EQ(origin.truth->distance_m.front(), 20);
  const std::vector<KeptFrame> frames = frames_of(one);
  ASSERT_EQ(frames.size(), 6U);
  EXPECT_NEAR(static_cast<double>(frames[1].photons_ps.size()), 9 * 1893, 5 * 131);
  EXPECT_EQ(frames[1].truth->velocity_mps, 2);
}

TEST(TradeoffPixel, ThatTheSimulatedArrayLacksIsRefused) {
  Config config = field_config();
  config.pixels[0].input = 99;
  EXPECT_THAT(test::error_text([&] { find_origin(config_of_pixel(std::move(config), ""), ""); }),
              AllOf(HasSubstr("/source/array"), HasSubstr("99")));
}

}  // namespace
}  // namespace splid::tradeoff
