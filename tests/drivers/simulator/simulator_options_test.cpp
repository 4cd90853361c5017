#include "drivers/simulator/simulator_options.hpp"

#include <gtest/gtest.h>

namespace splid::simulator {
namespace {

TEST(SimulatorOptions, DefaultsAreThePapersSetUp) {
  const Options options;
  EXPECT_FALSE(options.validate());
  EXPECT_EQ(options.detection.signal_per_pulse, 13.5e-4);
  EXPECT_EQ(options.background_per_s(), 175'000);
  EXPECT_EQ(options.detection.sigma_ps, 100);
  EXPECT_EQ(options.target.distance_m, 284.5);
  EXPECT_EQ(options.pace, Speed::live);
}

TEST(SimulatorOptions, FaultsOfTheTargetKeepTheirPlace) {
  Options options;
  options.target.motion = MotionKind::points;
  EXPECT_EQ(options.validate().value().pointer, "/target/points");
  options.more_targets.resize(2);
  options.target.motion = MotionKind::linear;
  EXPECT_FALSE(options.validate());
  options.more_targets[1].path.motion = MotionKind::points;
  EXPECT_EQ(options.validate().value().pointer, "/more_targets/1/points");
}

TEST(SimulatorOptions, SplitDetectorsNeedAnInputEach) {
  Options options;
  options.photon_input = 61;
  options.detector.inputs = 2;
  EXPECT_FALSE(options.validate());
  options.detector.inputs = 3;
  EXPECT_EQ(options.validate().value().pointer, "/detector/inputs");
}

}  // namespace
}  // namespace splid::simulator
