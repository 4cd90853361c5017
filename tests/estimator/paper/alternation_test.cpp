#include "estimator/paper/alternation.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "protocol/pattern_make.hpp"
#include "tests/estimator/paper/paper_scene.hpp"

namespace splid::paper {
namespace {

AlternationResult climb_from(const test::PaperScene& scene, const PaperParameters& start,
                             bool moving = true) {
  PaperLikelihood likelihood(scene.times, scene.emission, *scene.shape);
  return alternate(likelihood, start, moving);
}

TEST(Alternation, EndsWhereNothingIsUphill) {
  for (const double velocity : {0.0, -77.0, 149.0}) {
    const test::PaperScene scene(test::simulated_scene(make_random({}), velocity), 1);
    const auto result =
        climb_from(scene, {scene.delay_start_ns() + 0.2, velocity + 20, 0.003, 5e-3});
    const PaperParameters& p = result.parameters;
    PaperLikelihood likelihood(scene.times, scene.emission, *scene.shape);
    likelihood.move_to(p.delay_ns, p.velocity_mps);
    const auto point = likelihood.evaluate(p.signal_per_pulse, p.background_per_ns);
    EXPECT_EQ(point.gain_nats, result.gain_nats);
    EXPECT_GT(result.gain_nats, 100);
    // In units of about one standard deviation: a slope of 1e-4 is 1e-4 of one from the top.
    EXPECT_NEAR(point.by_delay * 0.1 / 10, 0, 1e-4);
    EXPECT_NEAR(point.by_velocity * 10, 0, 1e-4);
    EXPECT_NEAR(point.by_signal * 0.0018, 0, 1e-4);
    EXPECT_NEAR(point.by_background * 4e-5, 0, 1e-4);
    EXPECT_TRUE(result.stop == Stop::step_small || result.stop == Stop::gain_small);
    // Five deviations of the bound for 95 photons, which is 2 sigma / sqrt(95) at the frame's
    // start.
    EXPECT_NEAR(p.delay_ns, scene.delay_start_ns(), 0.1);
  }
}

TEST(Alternation, KeepsTheDelayWithinTenPulseWidths) {
  const test::PaperScene scene(test::simulated_scene(make_random({}), 0), 1);
  for (const double off_ns : {1.2, -1.2, 300.0}) {
    const double start_ns = scene.delay_start_ns() + off_ns;
    const auto result = climb_from(scene, {start_ns, 0, 0.018, 1e-3});
    EXPECT_LE(std::abs(result.parameters.delay_ns - start_ns), 1 + 1e-9);
    EXPECT_TRUE(std::isfinite(result.gain_nats));
  }
}

TEST(Alternation, ATargetAtRestStaysAtRest) {
  const test::PaperScene scene(test::simulated_scene(make_random({}), 0), 1);
  const auto result = climb_from(scene, {scene.delay_start_ns() - 0.2, 0, 0.018, 1e-3}, false);
  EXPECT_EQ(result.parameters.velocity_mps, 0);
  EXPECT_NEAR(result.parameters.delay_ns, scene.delay_start_ns(), 0.05);
}

TEST(Alternation, WithoutBackgroundItFallsToNothing) {
  test::FrameMaker made = test::simulated_scene(make_random({}), 20);
  made.background_per_ns = 0;
  const test::PaperScene scene(made, 1);
  const auto result = climb_from(scene, {scene.delay_start_ns(), 0, 0, 0});
  EXPECT_LT(result.parameters.background_per_ns * scene.times.seen_ns, 1e-5);
  EXPECT_NEAR(result.parameters.signal_per_pulse, 0.018, 0.018 * 5 / std::sqrt(95.0));
  EXPECT_NEAR(result.parameters.delay_ns, scene.delay_start_ns(), 0.1);
}

TEST(Alternation, WithoutPhotonsItDoesNotRun) {
  test::FrameMaker made = test::simulated_scene(make_random({}), 0);
  made.background_per_ns = 0;
  test::FrameMaker::Frame empty = made.make(1);
  empty.photons_ps.clear();
  EXPECT_EQ(climb_from({made, empty}, {100, 0, 0.018, 1e-3}).stop, Stop::not_run);
}

}  // namespace
}  // namespace splid::paper
