#include "drivers/simulator/scene_truth.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "protocol/error.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/scene_runs.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::simulator {
namespace {

std::string content(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(SceneTruth, IsTheMotionToAMicrometre) {
  Options options;
  options.seconds = 3;
  options.start_ps = 340'000'000'000'000'000;
  const SceneTruth truth = scene_truth(options);
  EXPECT_EQ(truth.step_ps, 1'000'000'000);
  EXPECT_EQ(truth.distance_m.size(), 3001U);
  const TargetPath motion(options.target);
  for (double time_s = 0.00037; time_s < 3; time_s += 0.0171) {
    const auto at_ps = options.start_ps + static_cast<std::int64_t>(time_s * 1e12);
    const auto state = truth.at(at_ps);
    ASSERT_TRUE(state);
    EXPECT_NEAR(state->distance_m, motion.at(time_s).distance_m, 1e-9);
    EXPECT_NEAR(state->velocity_mps, motion.at(time_s).velocity_mps, 1e-6);
  }
}

TEST(SceneTruth, HasThePathOfEachFurtherTarget) {
  Options options;
  options.seconds = 1;
  options.more_targets.resize(1);
  options.more_targets[0].path.motion = MotionKind::linear;
  options.more_targets[0].path.distance_m = 200;
  options.more_targets[0].path.velocity_mps = 3;
  options.more_targets[0].signal_per_pulse = 1e-3;
  const SceneTruth truth = scene_truth(options);
  ASSERT_EQ(truth.more_targets.size(), 1U);
  EXPECT_EQ(truth.more_targets[0].signal_per_pulse, 1e-3);
  ASSERT_EQ(truth.more_targets[0].distance_m.size(), truth.distance_m.size());
  EXPECT_NEAR(truth.more_targets[0].distance_m[500], 201.5, 1e-9);
  EXPECT_EQ(truth.more_targets[0].velocity_mps[500], 3);
}

TEST(SceneTruth, HasThePathOfEachPixel) {
  Options options;
  options.seconds = 1;
  options.array.columns = 2;
  options.array.planes.resize(1);
  options.array.planes[0].path.motion = MotionKind::linear;
  options.array.planes[0].path.distance_m = 30;
  options.array.planes[0].path.velocity_mps = 2;
  options.array.inputs.resize(1);
  options.array.inputs[0].input = 2;
  options.array.inputs[0].delay_ps = 70;
  options.array.inputs[0].dark_per_s = 1e4;
  const SceneTruth truth = scene_truth(options);
  ASSERT_EQ(truth.pixels.size(), 2U);
  EXPECT_EQ(truth.pixels[1].input, 2);
  EXPECT_EQ(truth.pixels[1].delay_ps, 70);
  EXPECT_EQ(truth.pixels[1].background_per_s, 184'500);
  EXPECT_EQ(truth.distance_m, truth.pixels[0].distance_m);
  ASSERT_EQ(truth.pixels[1].distance_m.size(), 101U);
  EXPECT_NEAR(truth.pixels[1].distance_m[50], 31, 1e-3);
  EXPECT_NEAR(truth.pixels[1].velocity_mps[50], 2, 1e-4);
}

TEST(SceneTruth, HoldsTheDepthOfALitTarget) {
  Options options;
  options.seconds = 1;
  EXPECT_EQ(to_json(scene_truth(options)).find("depth_m"), std::string::npos);
  options.target.depth_m = 0.4;
  EXPECT_EQ(truth_from_json(to_json(scene_truth(options))).depth_m, 0.4);
}

TEST(SceneTruth, HoldsTheScenesConstants) {
  Options options;
  options.seconds = 1;
  options.detection.electronic_delay_ns = 1855;
  const SceneTruth truth = scene_truth(options);
  EXPECT_EQ(truth.signal_per_pulse, 13.5e-4);
  EXPECT_EQ(truth.background_per_s, 175'000);
  EXPECT_EQ(truth.sigma_ps, 100);
  EXPECT_EQ(truth.electronic_delay_ns, 1855);
  EXPECT_EQ(truth.drift_ppm, 2);
}

TEST(SceneTruth, EndsWithTheStreamAndIsBounded) {
  Options options;
  options.seconds = 0.0105;
  SceneTruth truth = scene_truth(options);
  EXPECT_TRUE(truth.at(10'500'000'000));
  options.seconds = 3600;
  truth = scene_truth(options);
  EXPECT_EQ(truth.distance_m.size(), 600'001U);
  EXPECT_EQ(truth.step_ps, 6'000'000'000);
  options.seconds = 0;
  truth = scene_truth(options);
  EXPECT_EQ(truth.distance_m.size(), 600'001U);
  EXPECT_FALSE(truth.at(600'000'000'000'001));
}

TEST(SceneTruth, IsOnDiskBeforeTheFirstTag) {
  const test::TempFolder folder;
  const Pattern pattern = test::paper_pattern();
  Options options = test::noiseless_scene();
  options.truth = folder.path("scene.truth.json");
  SourceContext context;
  context.pattern = &pattern;
  test::VectorSink sink;
  bool there = false;
  sink.on_publish = [&](test::VectorSink& self) {
    if (self.tags.size() < 1000) there = truth_from_json(content(options.truth)).step_ps > 0;
  };
  options.open(context)->run(sink, {});
  EXPECT_TRUE(there);
  EXPECT_EQ(truth_from_json(content(options.truth)), scene_truth(options));
  // No temporary is left.
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path("")), {}), 1);
}

TEST(SceneTruth, AFileThatCannotBeWrittenIsNamed) {
  Options options;
  options.seconds = 0.01;
  options.truth = "/nonexistent/scene.truth.json";
  EXPECT_THAT(test::error_text([&] { write_truth_file(options); }),
              ::testing::AllOf(::testing::HasSubstr("/nonexistent/scene.truth.json"),
                               ::testing::HasSubstr("No such file")));
}

}  // namespace
}  // namespace splid::simulator
