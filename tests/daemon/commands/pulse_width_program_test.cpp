#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/known_truth.hpp"

// What the built program publishes of a simulated pulse that is two and a half times as wide as the
// configured pulse of 100 ps.

namespace splid {
namespace {

class WidePulse : public test::KnownTruth {
 protected:
  WidePulse() {
    simulate(R"("sigma_ps":250,"target":{"motion":"linear","distance_m":284.5,"velocity_mps":20})",
             "0.51");
  }
};

TEST_F(WidePulse, ItsWidthIsFound) {
  const auto frames = replayed(R"(,"pulse":{"sigma_ps":100,"width":"fitted"})");
  EXPECT_GE(frames.size(), 9U);
  test::Pulls width, distance, velocity;
  for (const FrameMessage& frame : frames) {
    EXPECT_EQ(frame.status, FrameStatus::ok);
    ASSERT_TRUE(frame.pulse_sigma_ps);
    const SceneTruth::State there = true_state(frame);
    width.add(*frame.pulse_sigma_ps, truth.sigma_ps, *frame.std_pulse_sigma_ps);
    distance.add(*frame.distance_m, there.distance_m, *frame.std_distance_m);
    velocity.add(*frame.velocity_mps, there.velocity_mps, *frame.std_velocity_mps);
    EXPECT_LT(*frame.std_pulse_sigma_ps, 25);
    EXPECT_LT(*frame.std_distance_m, 0.006);
  }
  width.expect_right("width");
  distance.expect_right("distance");
  velocity.expect_right("velocity");
}

// The deviations hold what another width leaves uncertain.
TEST_F(WidePulse, IsWithinTheDeviationsWhereTheWidthIsFixed) {
  const auto frames = replayed("");
  EXPECT_GE(frames.size(), 9U);
  for (const FrameMessage& frame : frames) {
    EXPECT_EQ(frame.status, FrameStatus::ok);
    EXPECT_FALSE(frame.pulse_sigma_ps);
    const double off_m = *frame.distance_m - true_state(frame).distance_m;
    EXPECT_LT(std::abs(off_m), 4 * *frame.std_distance_m);
  }
}

}  // namespace
}  // namespace splid
