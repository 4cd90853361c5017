#include <gtest/gtest.h>

#include <string>

#include "tests/support/known_truth.hpp"

// What the built program publishes of simulated light so strong that a detector of 45 ns dead time
// misses an eighth of it.

namespace splid {
namespace {

class DetectorWithDeadTime : public test::KnownTruth {
 protected:
  DetectorWithDeadTime() {
    simulate(R"("ambient_per_s":3e6,"signal_per_pulse":0.01,"detector":{"dead_time_ns":45},)"
             R"("target":{"motion":"linear","distance_m":284.5,"velocity_mps":20})",
             "0.41");
  }
  std::vector<FrameMessage> replayed_as(const std::string& dead_time) const {
    return replayed(R"(,"detector":{"dead_time_ns":45,"dead_time":")" + dead_time + "\"}");
  }
};

TEST_F(DetectorWithDeadTime, HidesNothingWhereItsDeadTimeIsModelled) {
  const auto frames = replayed_as("modelled");
  EXPECT_GE(frames.size(), 7U);
  test::Pulls distance, velocity, signal, background;
  for (const FrameMessage& frame : frames) {
    EXPECT_EQ(frame.status, FrameStatus::ok);
    const SceneTruth::State there = true_state(frame);
    distance.add(*frame.distance_m, there.distance_m, *frame.std_distance_m);
    velocity.add(*frame.velocity_mps, there.velocity_mps, *frame.std_velocity_mps);
    signal.add(*frame.signal_per_pulse, truth.signal_per_pulse, *frame.std_signal_per_pulse);
    background.add(*frame.background_per_s, truth.background_per_s, *frame.std_background_per_s);
    EXPECT_NEAR(frame.blind_fraction.value(), 0.125, 0.01);
    // Without the model both would read an eighth too low, which is many deviations.
    EXPECT_LT(*frame.std_signal_per_pulse, 0.02 * truth.signal_per_pulse);
    EXPECT_LT(*frame.std_background_per_s, 0.01 * truth.background_per_s);
  }
  distance.expect_right("distance");
  velocity.expect_right("velocity");
  signal.expect_right("signal");
  background.expect_right("background");
}

TEST_F(DetectorWithDeadTime, SaturatesWhereItsDeadTimeIsFlagged) {
  const auto frames = replayed_as("flagged");
  EXPECT_GE(frames.size(), 7U);
  for (const FrameMessage& frame : frames) {
    EXPECT_EQ(frame.status, FrameStatus::saturated);
    EXPECT_FALSE(frame.valid());
  }
}

}  // namespace
}  // namespace splid
