#include "estimator/fit/width_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "estimator/fit/bound.hpp"
#include "estimator/frame_estimator.hpp"
#include "protocol/error.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

constexpr double width_scene_c = 0.299792458;

// A short frame of a target whose pulses are 1.7 times as wide as configured.
struct WideTarget {
  test::FrameMaker made;
  test::FrameMaker::Frame frame;
  PulseTrain train;
  FoldedFrame folded;
  FrameParameters truth;

  static test::FrameMaker maker() {
    test::FrameMaker made;
    made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
    double amplitude = 1;
    for (double& a : made.pattern.segments.front().amplitudes) a = amplitude += 0.02;
    made.length_ms = 2;
    made.velocity_mps = 31;
    made.signal_per_pulse = 0.01;
    made.sigma_ns = 0.17;
    return made;
  }
  WideTarget()
      : made(maker()),
        frame(made.make(11)),
        train(made.pattern),
        folded(train, frame.photons_ps.size()) {
    folded.fold(frame.view(), train);
    const double beta = made.velocity_mps / 299792458.0;
    truth = {{2 * made.distance_m / width_scene_c / (1 + beta) / folded.scale,
              2 * beta / (1 + beta) * folded.length_ns},
             made.signal_per_pulse,
             made.background_per_ns};
  }
};

// With hardly any background, N photons tell a gaussian's width to 1 / sqrt(2 N) of itself, and
// the delay as well as with the width known.
TEST(WidthBound, IsThatOfAGaussiansDeviation) {
  const Pattern pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  BoundScene scene = {5e6, 5e6, 1898, 31, 0.01, 1e-12};
  const GaussianPulse shape(0.17);
  const Bound known = cramer_rao_bound(pattern, shape, scene);
  scene.width_unknown = true;
  const Bound bound = cramer_rao_bound(pattern, shape, scene);
  const double photons = 0.01 * 40 * 5e6 / 3780;
  EXPECT_EQ(known.pulse_sigma_ns, 0);
  EXPECT_NEAR(bound.pulse_sigma_ns, 0.17 / std::sqrt(2 * photons), 1e-4 * 0.17);
  EXPECT_NEAR(bound.delay_ns / known.delay_ns, 1, 1e-6);
  // Where there is background, a wider pulse takes light from it.
  scene.background_per_ns = 1e-2;
  const double with_width = cramer_rao_bound(pattern, shape, scene).signal_per_pulse;
  scene.width_unknown = false;
  EXPECT_GT(with_width, 1.05 * cramer_rao_bound(pattern, shape, scene).signal_per_pulse);
}

// Sums of squares over bound and over deviation, and how many are within their deviation.
struct WidthScore {
  double over_bound = 0, over_std = 0;
  int within = 0;
  void add(double error, double bound, double deviation) {
    over_bound += error * error / (bound * bound);
    over_std += error * error / (deviation * deviation);
    within += std::abs(error) <= deviation ? 1 : 0;
  }
};

PulseOptions fitted_pulse() {
  PulseOptions pulse;
  pulse.width = PulseWidth::fitted;
  return pulse;
}

TEST(WidthFit, IsAtTheBoundAndSaysSo) {
  constexpr int frames = 150;
  for (const double sigma_ns : {0.06, 0.1, 0.2, 0.3}) {
    test::FrameMaker made = WideTarget::maker();
    made.length_ms = 10;
    made.sigma_ns = sigma_ns;
    made.signal_per_pulse = 0.004;
    FrameEstimator estimator(made.pattern, fitted_pulse(), {}, {}, made.length_ms, 50'000);
    BoundScene scene = {10e6,
                        10e6,
                        2 * made.distance_m / width_scene_c,
                        made.velocity_mps,
                        made.signal_per_pulse,
                        made.background_per_ns};
    scene.width_unknown = true;
    const Bound bound = cramer_rao_bound(made.pattern, GaussianPulse(sigma_ns), scene);
    WidthScore delay, velocity, signal, width;
    for (std::uint64_t n = 0; n < frames; ++n) {
      const Estimate e = estimator.estimate(made.make(n).view());
      ASSERT_GT(e.std_pulse_sigma_ns, 0);
      EXPECT_EQ(e.pulse_misfit, std::nullopt);
      delay.add(e.delay_ns - 2 * made.distance_m / width_scene_c, bound.delay_ns, e.std_delay_ns);
      velocity.add(e.velocity_mps - made.velocity_mps, bound.velocity_mps, e.std_velocity_mps);
      signal.add(e.signal_per_pulse - made.signal_per_pulse, bound.signal_per_pulse,
                 e.std_signal_per_pulse);
      width.add(e.pulse_sigma_ns - sigma_ns, bound.pulse_sigma_ns, e.std_pulse_sigma_ns);
    }
    // A root mean square of 150 frames is known to 6 %, and a share of 68 % to 3.8 %.
    for (const WidthScore& score : {delay, velocity, signal, width}) {
      EXPECT_NEAR(std::sqrt(score.over_bound / frames), 1, 0.2) << sigma_ns;
      EXPECT_NEAR(std::sqrt(score.over_std / frames), 1, 0.2) << sigma_ns;
      EXPECT_NEAR(score.within, 0.68 * frames, 0.14 * frames) << sigma_ns;
    }
  }
}

// So bright that the photons are gathered in cells before they are fitted.
TEST(WidthFit, GatheredPhotonsTellTheSameWidth) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.sigma_ns = 0.15;
  made.signal_per_pulse = 0.3;
  made.length_ms = 20;
  FrameEstimator estimator(made.pattern, fitted_pulse(), {}, {}, made.length_ms, 200'000);
  double off = 0;
  constexpr int frames = 8;
  for (std::uint64_t n = 0; n < frames; ++n) {
    const Estimate e = estimator.estimate(made.make(n).view());
    ASSERT_GT(e.std_pulse_sigma_ns, 0);
    EXPECT_LT(e.std_pulse_sigma_ns, 0.004 * 0.15);
    off += (e.pulse_sigma_ns - 0.15) / e.std_pulse_sigma_ns / frames;
  }
  EXPECT_LT(std::abs(off), 4 / std::sqrt(frames));
}

TEST(WidthFit, AllocatesNothing) {
  const test::FrameMaker made = WideTarget::maker();
  FrameEstimator estimator(made.pattern, fitted_pulse(), {}, {}, made.length_ms, 50'000);
  const auto first = made.make(1), second = made.make(2);
  estimator.estimate(first.view());
  const std::uint64_t before = test::allocations;
  const Estimate e = estimator.estimate(second.view());
  EXPECT_EQ(test::allocations, before);
  EXPECT_GT(e.std_pulse_sigma_ns, 0);
}

TEST(WidthFit, FitsATargetAtRest) {
  test::FrameMaker made = WideTarget::maker();
  made.velocity_mps = 0;
  SceneOptions scene;
  scene.motion = Motion::static_target;
  FrameEstimator estimator(made.pattern, fitted_pulse(), scene, {}, made.length_ms, 50'000);
  const Estimate e = estimator.estimate(made.make(1).view());
  EXPECT_EQ(e.status, FrameStatus::ok);
  EXPECT_EQ(e.velocity_mps, 0);
  EXPECT_EQ(e.std_velocity_mps, 0);
  EXPECT_NEAR(e.pulse_sigma_ns, 0.17, 4 * e.std_pulse_sigma_ns);
}

// Six widths are beyond what is fitted: the frame has no width, and says what is wrong.
TEST(WidthFit, PublishesNoWidthBeyondItsLimits) {
  test::FrameMaker made = WideTarget::maker();
  made.sigma_ns = 0.6;
  made.signal_per_pulse = 0.1;
  FrameEstimator estimator(made.pattern, fitted_pulse(), {}, {}, made.length_ms, 50'000);
  const Estimate e = estimator.estimate(made.make(1).view());
  EXPECT_EQ(e.std_pulse_sigma_ns, 0);
  EXPECT_TRUE(e.pulse_misfit);
}

TEST(WidthFit, RefusesWhatDoesNotGoWithIt) {
  const Pattern pattern = test::periodic_pattern(94500);
  const auto refused = [&](const SceneOptions& scene, const EstimatorOptions& options) {
    try {
      const FrameEstimator estimator(pattern, fitted_pulse(), scene, options, 1, 1000);
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::usage);
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refused({}, {}), "");
  SceneOptions two;
  two.targets = 2;
  EXPECT_NE(refused(two, {}).find("pulse/width: is \"fitted\", but scene.targets is 2"),
            std::string::npos);
  SceneOptions bent;
  bent.motion = Motion::accelerating;
  EXPECT_NE(refused(bent, {}).find("acceleration"), std::string::npos);
  EstimatorOptions paper;
  paper.method = Method::paper;
  EXPECT_NE(refused({}, paper).find("method of [P]"), std::string::npos);
}

}  // namespace
}  // namespace splid
