#include "drivers/simulator/target_path.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace splid::simulator {
namespace {

using testing::HasSubstr;

TargetOptions points_target() {
  TargetOptions options;
  options.motion = MotionKind::points;
  options.points = {{0, 100}, {1, 103}, {3, 101}};
  return options;
}

TEST(TargetPath, LinearGoesOnForEver) {
  TargetOptions options;
  options.motion = MotionKind::linear;
  options.distance_m = 50;
  options.velocity_mps = -2;
  const TargetPath motion(options);
  EXPECT_DOUBLE_EQ(motion.at(10).distance_m, 30);
  EXPECT_DOUBLE_EQ(motion.at(-10).distance_m, 70);
  EXPECT_EQ(motion.at(3).velocity_mps, -2);
}

TEST(TargetPath, SinusoidStartsAtItsPhase) {
  TargetOptions options;
  options.distance_m = 200;
  options.amplitude_m = 3;
  options.period_s = 8;
  options.phase_turns = 0.25;
  const TargetPath motion(options);
  EXPECT_NEAR(motion.at(0).distance_m, 203, 1e-12);
  EXPECT_NEAR(motion.at(0).velocity_mps, 0, 1e-12);
  EXPECT_NEAR(motion.at(4).distance_m, 197, 1e-12);
}

TEST(TargetPath, PointsAreVisitedToAndFro) {
  const TargetPath motion(points_target());
  EXPECT_DOUBLE_EQ(motion.at(0.5).distance_m, 101.5);
  EXPECT_DOUBLE_EQ(motion.at(0.5).velocity_mps, 3);
  EXPECT_DOUBLE_EQ(motion.at(2).distance_m, 102);
  EXPECT_DOUBLE_EQ(motion.at(2).velocity_mps, -1);
  EXPECT_DOUBLE_EQ(motion.at(4).distance_m, 102);
  EXPECT_DOUBLE_EQ(motion.at(4).velocity_mps, 1);
  EXPECT_DOUBLE_EQ(motion.at(6.5).distance_m, 101.5);
  EXPECT_DOUBLE_EQ(motion.at(-0.5).distance_m, 101.5);
  EXPECT_DOUBLE_EQ(motion.at(-0.5).velocity_mps, -3);
}

class VelocityIsTheSlope : public testing::TestWithParam<MotionKind> {};

TEST_P(VelocityIsTheSlope, AwayFromCorners) {
  TargetOptions options = points_target();
  options.motion = GetParam();
  options.velocity_mps = 7;
  const TargetPath motion(options);
  constexpr double h_s = 1e-4;
  for (const double time_s : {-4.3, -0.2, 0.31, 1.7, 3.9, 12.345}) {
    const double slope_mps =
        (motion.at(time_s + h_s).distance_m - motion.at(time_s - h_s).distance_m) / (2 * h_s);
    EXPECT_NEAR(motion.at(time_s).velocity_mps, slope_mps, 1e-7) << time_s;
  }
}

INSTANTIATE_TEST_SUITE_P(AllMotions, VelocityIsTheSlope,
                         testing::Values(MotionKind::linear, MotionKind::sinusoid,
                                         MotionKind::points));

TEST(TargetOptions, DefaultsAreValidAndBiasAFrameLittle) {
  const TargetOptions options;
  EXPECT_FALSE(options.validate());
  // Largest acceleration from a numeric second derivative; 50 ms frames.
  const TargetPath motion(options);
  double largest_mps2 = 0;
  for (double time_s = 0; time_s < options.period_s; time_s += 0.01) {
    const double change_mps =
        motion.at(time_s + 1e-3).velocity_mps - motion.at(time_s - 1e-3).velocity_mps;
    largest_mps2 = std::max(largest_mps2, std::abs(change_mps) / 2e-3);
  }
  EXPECT_LT(largest_mps2 * 0.05 * 0.05 / 24, 0.05e-3);
  EXPECT_GT(largest_mps2, 0.1);
}

TEST(TargetOptions, FaultsNameTheirKey) {
  TargetOptions one_point = points_target();
  one_point.points.resize(1);
  EXPECT_EQ(one_point.validate().value().pointer, "/points");
  TargetOptions unordered = points_target();
  unordered.points[2].time_s = 1;
  EXPECT_EQ(unordered.validate().value().pointer, "/points/2/time_s");
  TargetOptions fast = points_target();
  fast.points[1].distance_m = 40'000;
  EXPECT_EQ(fast.validate().value().pointer, "/points/1/distance_m");
  TargetOptions far;
  far.amplitude_m = 285;
  EXPECT_THAT(far.validate().value().what, HasSubstr("distance_m"));
  TargetOptions quick;
  quick.period_s = 1e-4;
  EXPECT_THAT(quick.validate().value().what, HasSubstr("30000"));
}

}  // namespace
}  // namespace splid::simulator
