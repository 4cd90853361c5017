#include "estimator/paper/alternation.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "protocol/pattern_make.hpp"
#include "tests/estimator/paper/paper_scene.hpp"

namespace splid::paper {
namespace {

AlternationResult climb_from(const test::PaperScene& scene, const PaperParameters& start,
                             bool moving = true) {
  likelihood::LogLikelihood likelihood(*scene.shape, scene.train, scene.folded.size(), {});
  likelihood.begin(scene.folded);
  return alternate(likelihood, start, moving);
}

// The gain at [P]'s parameters: its tau, at the frame's start, is D (1 + beta) there.
double gain_at(const test::PaperScene& scene, const PaperParameters& p) {
  likelihood::LogLikelihood likelihood(*scene.shape, scene.train, scene.folded.size(), {});
  likelihood.begin(scene.folded);
  const double beta = p.velocity_mps / speed_of_light_mps;
  const double walk_ns = 2 * beta / (1 + beta) * scene.folded.length_ns;
  const likelihood::Model model = likelihood::model_of(
      {p.delay_ns / (1 + beta) + walk_ns / 2, walk_ns}, p.signal_per_pulse, p.background_per_ns);
  likelihood.collect(model, scene.folded.size());
  likelihood::Point point;
  likelihood.evaluate(model, {}, point);
  return point.value - likelihood.no_target_nats();
}

// In steps of a tenth of a standard deviation or so, at which a parabola falls by 0.005.
TEST(Alternation, EndsWhereNothingIsUphill) {
  for (const double velocity : {0.0, -77.0, 149.0}) {
    const test::PaperScene scene(test::simulated_scene(make_random({}), velocity), 1);
    const auto result =
        climb_from(scene, {scene.delay_start_ns() + 0.2, velocity + 20, 0.003, 5e-3});
    const PaperParameters& p = result.parameters;
    EXPECT_NEAR(gain_at(scene, p), result.gain_nats, 1e-9);
    EXPECT_GT(result.gain_nats, 100);
    const auto slope = [&](double PaperParameters::*which, double step) {
      PaperParameters up = p, down = p;
      up.*which += step;
      down.*which -= step;
      const double rise = gain_at(scene, up) - gain_at(scene, down);
      EXPECT_LT(gain_at(scene, up) + gain_at(scene, down), 2 * result.gain_nats - 1e-3);
      return rise;
    };
    EXPECT_NEAR(slope(&PaperParameters::delay_ns, 1e-3), 0, 1e-3);
    EXPECT_NEAR(slope(&PaperParameters::velocity_mps, 1), 0, 1e-3);
    EXPECT_NEAR(slope(&PaperParameters::signal_per_pulse, 1.8e-4), 0, 1e-3);
    EXPECT_NEAR(slope(&PaperParameters::background_per_ns, 4e-6), 0, 1e-3);
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
  EXPECT_LT(result.parameters.background_per_ns * scene.folded.seen_ns, 1e-5);
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
