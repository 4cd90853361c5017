#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "estimator/checks/pulse_check.hpp"
#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"
#include "tests/support/sanitized.hpp"

// The shape of pulses whose width is fitted.

namespace splid {
namespace {

constexpr double fitted_from_ns = 0.1;

struct Shapes {
  int said = 0;
  double skew = 0, std_skew = 0;  // the mean over draws, with weights
  double squares = 0;             // the mean square of the skewness in its deviations
};

// What the check says of light of which a share comes behind_ns later.
Shapes shapes_of(double ratio, int photons, double share, double behind_ns, int draws) {
  const GaussianPulse shape(fitted_from_ns);
  PulseCheck check(shape, 9, true);
  std::mt19937_64 random(23);
  std::normal_distribution<double> pulse(0, ratio * fitted_from_ns);
  std::bernoulli_distribution is_behind(share);
  std::uniform_real_distribution<double> window(check.first_ns(), check.last_ns());
  std::poisson_distribution<int> light(photons), dark(30 * (check.last_ns() - check.first_ns()));
  Shapes shapes;
  double weights = 0;
  for (int n = 0; n < draws; ++n) {
    check.clear();
    for (int k = light(random); k > 0; --k) {
      const double t = pulse(random) + (is_behind(random) ? behind_ns : 0);
      if (t > check.first_ns() && t < check.last_ns()) check.add(t);
    }
    for (int k = dark(random); k > 0; --k) check.add(window(random));
    const ShapeVerdict verdict = check.judge_shape(30 * check.bin_ns(), ratio);
    shapes.said += verdict.misfit ? 1 : 0;
    if (verdict.std_skew == 0) continue;  // too few photons
    const double weight = 1 / (verdict.std_skew * verdict.std_skew);
    weights += weight;
    shapes.skew += weight * verdict.skew;
    shapes.squares += verdict.skew * verdict.skew * weight / draws;
  }
  shapes.skew /= weights;
  shapes.std_skew = 1 / std::sqrt(weights);
  return shapes;
}

TEST(ShapeCheck, SaysNothingOfAGaussian) {
  for (const double ratio : {0.5, 1.0, 3.0}) {
    for (const int photons : {60, 200, 700, 5000}) {
      const Shapes shapes = shapes_of(ratio, photons, 0, 0, test::times(1000));
      EXPECT_EQ(shapes.said, 0) << ratio << ' ' << photons;
      EXPECT_LT(std::abs(shapes.skew), 4 * shapes.std_skew) << ratio << ' ' << photons;
      EXPECT_NEAR(shapes.squares, 1, 0.25) << ratio << ' ' << photons;
    }
  }
}

// Two surfaces, four widths apart, are no gaussian, whichever is brighter or neither.
TEST(ShapeCheck, NoticesTwoSurfaces) {
  for (const double share : {1.0 / 3, 0.5, 2.0 / 3}) {
    EXPECT_EQ(shapes_of(1, 1000, share, 0.4, 50).said, 50) << share;
  }
}

// A third of the light two widths behind has the skewness 0.22, and a fourth moment that one step
// takes for a little more.
TEST(ShapeCheck, SaysOnAverageHowSkewALightIs) {
  const Shapes behind = shapes_of(1, 1000, 1.0 / 3, 0.2, 400);
  EXPECT_NEAR(behind.skew, 0.26, 0.06);
  const Shapes before = shapes_of(1, 1000, 2.0 / 3, 0.2, 400);
  EXPECT_NEAR(before.skew, -0.26, 0.06);
  EXPECT_GT(behind.skew, 6 * behind.std_skew);
}

test::FrameMaker fitted_target() {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.velocity_mps = 30;
  return made;
}

Estimate fitted_estimate(FrameEstimator& estimator, const test::FrameMaker::Frame& frame) {
  Estimate e = estimator.estimate(frame.view());
  EXPECT_GT(e.std_pulse_sigma_ns, 0);
  return e;
}

FrameEstimator with_fitted_width(const test::FrameMaker& made) {
  PulseOptions pulse;
  pulse.width = PulseWidth::fitted;
  return FrameEstimator(made.pattern, pulse, {}, {}, made.length_ms, 100'000);
}

TEST(ShapeMisfit, IsAbsentOfAWideGaussian) {
  test::FrameMaker made = fitted_target();
  FrameEstimator estimator = with_fitted_width(made);
  for (const double sigma_ns : {0.06, 0.1, 0.25}) {
    made.sigma_ns = sigma_ns;
    for (std::uint64_t n = 0; n < 40; ++n) {
      const Estimate e = fitted_estimate(estimator, made.make(n));
      EXPECT_FALSE(e.shape_misfit) << sigma_ns << ' ' << n;
      EXPECT_GT(e.std_pulse_skew, 0);
    }
  }
}

// The distance of light with a tail is off by some ten of the deviations that the fit gives.
TEST(ShapeMisfit, OfATailIsSaidAndInTheDeviationOfTheDistance) {
  test::FrameMaker made = fitted_target();
  made.signal_per_pulse *= 4;
  made.late_share = 0.3;
  made.late_ns = 0.2;
  FrameEstimator estimator = with_fitted_width(made);
  for (std::uint64_t n = 0; n < 20; ++n) {
    const Estimate e = fitted_estimate(estimator, made.make(n));
    ASSERT_TRUE(e.shape_misfit) << n;
    EXPECT_GT(e.pulse_skew, 3 * e.std_pulse_skew);
    const double off_ns = e.delay_ns - 2 * made.distance_m / 0.299792458;
    EXPECT_GT(off_ns, 0.02);
    EXPECT_LT(off_ns, 1.5 * e.std_delay_ns);
  }
}

}  // namespace
}  // namespace splid
