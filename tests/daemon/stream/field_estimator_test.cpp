#include "daemon/stream/field_estimator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "daemon/stream/stream.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/field_scene.hpp"

// The scenes `rigid` and `pool`, from the tags of an array to the estimates of its pixels.

namespace splid {
namespace {

using testing::HasSubstr;

// 4 x 2 pixels: a plate of 2 x 2 moves before a wall.
simulator::Options plate_before_wall() {
  simulator::Options scene;
  scene.pace = simulator::Speed::max;
  scene.seconds = 0.26;
  scene.array.columns = 4;
  scene.array.rows = 2;
  simulator::Plane plate;
  plate.path.motion = simulator::MotionKind::linear;
  plate.path.distance_m = 20;
  plate.path.velocity_mps = 1.2;
  plate.field.azimuth_deg = {-0.06, 0.06};
  simulator::Plane wall = plate;
  wall.path.distance_m = 25;
  wall.path.velocity_mps = 0;
  wall.field = {};
  scene.array.planes = {plate, wall};
  return scene;
}

Config config_of_array() {
  std::vector<PixelOptions> pixels = test::pixels_of(8);
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    pixels[p].azimuth_deg = 0.1 * static_cast<double>(p % 4);
    pixels[p].elevation_deg = -0.1 * static_cast<double>(p / 4);
  }
  return test::with_pixels(scene_config(0), pixels);
}

bool is_plate(std::size_t pixel) { return pixel % 4 == 1 || pixel % 4 == 2; }

struct Pixel : Estimate {
  TargetTrack seen;
};

// Each frame's estimates.
std::vector<std::vector<Pixel>> measured(const Config& config, const std::vector<Tag>& tags) {
  Stream stream(stream_options(config), test::script(tags), host_clock());
  std::vector<std::vector<Pixel>> all;
  stream.start();
  while (!stream.ended()) {
    const EstimationUnit* unit = stream.next();
    if (unit == nullptr) {
      stream.wait(std::chrono::milliseconds{50});
      continue;
    }
    all.emplace_back();
    for (const PixelEstimate& pixel : unit->pixels)
      all.back().push_back({pixel.estimate, pixel.seen});
    stream.release();
  }
  EXPECT_EQ(stream.join(), nullptr);
  all.pop_back();  // the stream's end cuts the last frame
  return all;
}

TEST(FieldEstimator, PixelsOfABodyShareItsVelocity) {
  Config config = config_of_array();
  config.scene.rigid = true;
  const std::vector<Tag> tags = test::simulate(plate_before_wall(), config.pattern);
  const auto frames = measured(config, tags);
  ASSERT_GE(frames.size(), 4U);
  for (const auto& frame : frames) {
    for (std::size_t p = 0; p < frame.size(); ++p) {
      ASSERT_EQ(frame[p].status, FrameStatus::ok);
      EXPECT_EQ(frame[p].velocity_mps, frame[is_plate(p) ? 1 : 0].velocity_mps) << p;
      EXPECT_NEAR(frame[p].velocity_mps, is_plate(p) ? 1.2 : 0, 5 * frame[p].std_velocity_mps);
      EXPECT_LT(frame[p].std_velocity_mps, 0.025);  // 4.3 cm/s alone
    }
  }
  for (const std::int64_t threads : {2, 3}) {
    config.pipeline.estimation_threads = threads;
    const auto again = measured(config, tags);
    ASSERT_EQ(again.size(), frames.size());
    for (std::size_t n = 0; n < frames.size(); ++n) {
      for (std::size_t p = 0; p < frames[n].size(); ++p) {
        EXPECT_EQ(again[n][p].velocity_mps, frames[n][p].velocity_mps);
        EXPECT_EQ(again[n][p].delay_ns, frames[n][p].delay_ns);
        EXPECT_EQ(again[n][p].std_delay_ns, frames[n][p].std_delay_ns);
      }
    }
  }
}

TEST(FieldEstimator, FaintPixelsArePooled) {
  simulator::Options scene = plate_before_wall();
  scene.array.planes.erase(scene.array.planes.begin());
  scene.array.planes[0].signal_per_pulse = 4e-6;
  scene.ambient_per_s = 300;
  scene.dark_per_s = 0;
  Config config = config_of_array();
  const std::vector<Tag> tags = test::simulate(scene, config.pattern);
  std::size_t alone = 0, pooled = 0;
  for (const bool pool : {false, true}) {
    config.scene.pool = pool;
    for (const auto& frame : measured(config, tags)) {
      for (const Estimate& estimate : frame) {
        if (estimate.status != FrameStatus::ok) continue;
        ++(pool ? pooled : alone);
        EXPECT_NEAR(estimate.delay_ns, 166.78, 0.3);
      }
    }
  }
  EXPECT_LE(alone, 2U);
  EXPECT_GE(pooled, 24U);
}

// A column of the plate is dark for the first frames. Its pixels then begin where their neighbours
// see the plate, without a search.
TEST(FieldEstimator, NeighboursHelpWhateverTheThreads) {
  Config config = config_of_array();
  config.estimator.tracked = true;
  std::vector<Tag> tags = test::simulate(plate_before_wall(), config.pattern);
  std::erase_if(tags, [](const Tag& tag) {
    return tag.kind == TagKind::photon && tag.value % 4 == 3 && tag.time_ps < 100'000'000'000;
  });
  const auto frames = measured(config, tags);
  ASSERT_GE(frames.size(), 4U);
  for (std::size_t p = 0; p < 8; ++p) {
    EXPECT_EQ(frames[0][p].status, p % 4 == 2 ? FrameStatus::no_target : FrameStatus::ok) << p;
    EXPECT_EQ(frames.back()[p].status, FrameStatus::ok) << p;
    const double distance_m = is_plate(p) ? 20.26 : 25;
    EXPECT_NEAR(frames.back()[p].delay_ns, distance_m / 0.149896229, 0.5) << p;
  }
  for (const std::size_t p : {2U, 6U}) {
    EXPECT_EQ(frames[1][p].status, FrameStatus::no_target) << p;
    EXPECT_GT(frames[2][p].seen.followed, 0) << p;
  }
  for (const std::int64_t threads : {2, 3}) {
    config.pipeline.estimation_threads = threads;
    const auto again = measured(config, tags);
    ASSERT_EQ(again.size(), frames.size());
    for (std::size_t n = 0; n < frames.size(); ++n) {
      for (std::size_t p = 0; p < 8; ++p) {
        EXPECT_EQ(again[n][p].delay_ns, frames[n][p].delay_ns) << n << " " << p;
        EXPECT_EQ(again[n][p].velocity_mps, frames[n][p].velocity_mps) << n << " " << p;
        EXPECT_EQ(again[n][p].range_odds_nats, frames[n][p].range_odds_nats) << n << " " << p;
      }
    }
  }
}

TEST(FieldEstimator, PixelsThatDoNotFitTheSceneAreRefused) {
  const auto refusal = [](const Config& config) {
    return test::error_text([&] { check_stream(stream_options(config)); });
  };
  Config config = config_of_array();
  config.scene.rigid = true;
  EXPECT_EQ(refusal(config), "");
  config.pixels[2].sigma_ps = 80;
  EXPECT_THAT(refusal(config), HasSubstr("/scene/rigid: is true; all /pixels then need one"));
  config.pixels[2].sigma_ps.reset();
  config.estimator.method = Method::paper;
  EXPECT_THAT(refusal(config), HasSubstr("/scene/rigid: is true; /estimator/method \"paper\""));
  config.estimator.method = Method::search;
  config.scene.rigid = false;
  config.scene.pool = true;
  config.pixels[3].azimuth_deg.reset();
  EXPECT_THAT(refusal(config), HasSubstr("/scene/pool: is true; the pixel 4 needs azimuth_deg"));
  config.pixels.clear();
  EXPECT_THAT(refusal(config), HasSubstr("/scene/pool: is true; it needs several /pixels"));
}

}  // namespace
}  // namespace splid
