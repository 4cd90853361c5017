#include "drivers/simulator/echo.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace splid::simulator {
namespace {

constexpr long double c_m_per_ps = 299'792'458e-12L;

TargetPath linear_motion(double distance_m, double velocity_mps) {
  TargetOptions options;
  options.motion = MotionKind::linear;
  options.distance_m = distance_m;
  options.velocity_mps = velocity_mps;
  return TargetPath(options);
}

class ConstantVelocity : public testing::TestWithParam<double> {};

// z0 + v t = c (t - e) has the flight (z0 + v e) / (c - v), here from long doubles.
TEST_P(ConstantVelocity, HasTheClosedFormsFlight) {
  const double velocity_mps = GetParam();
  const TargetPath motion = linear_motion(50'000, velocity_mps);
  for (const std::int64_t emitted_ps : {0LL, 3'780'000LL, 999'999'999'999LL, -2'000'000LL}) {
    const long double v = velocity_mps * 1e-12L;
    const long double flight_ps = (50'000 + v * emitted_ps) / (c_m_per_ps - v);
    const double got_ps = round_trip_ps(motion, {emitted_ps, 0}).value();
    EXPECT_NEAR(got_ps, static_cast<double>(2 * flight_ps), 1e-4) << emitted_ps;
  }
}

INSTANTIATE_TEST_SUITE_P(Speeds, ConstantVelocity,
                         testing::Values(0.0, 1e-3, 150.0, -150.0, 30'000.0, -30'000.0));

// By bisection, with no derivative: the meeting point of light and a target that accelerates.
TEST(Echo, MeetsASwingingTarget) {
  TargetOptions options;
  options.amplitude_m = 100;
  options.period_s = 0.1;
  const TargetPath motion(options);
  for (const double emitted_s : {0.0, 0.0131, 0.05, 0.0777}) {
    double low_s = 0;
    double high_s = 1e-5;
    for (int i = 0; i < 200; ++i) {
      const double mid_s = 0.5 * (low_s + high_s);
      const bool light_is_behind = motion.at(emitted_s + mid_s).distance_m > 299'792'458.0 * mid_s;
      (light_is_behind ? low_s : high_s) = mid_s;
    }
    const FineTime emitted = FineTime{}.after(emitted_s * 1e12);
    EXPECT_NEAR(round_trip_ps(motion, emitted).value(), 2e12 * low_s, 1e-3);
  }
}

// A tagger that is 100 ppm fast counts a ten-thousandth more of the light's time, and sees the
// target pass its places as much later.
TEST(Echo, AFastTaggerCountsMoreOfTheLightsTime) {
  TargetOptions options;
  options.motion = MotionKind::linear;
  options.distance_m = 284.5;
  options.velocity_mps = 150;
  const long double rate = 1 + 1e-4L;
  for (const std::int64_t emitted_ps : {0LL, 999'999'999'999LL}) {
    const long double true_ps = emitted_ps / rate;
    const long double v = 150e-12L;
    const long double flight_ps = (284.5L + v * true_ps) / (c_m_per_ps - v);
    EXPECT_NEAR(round_trip_ps(TargetPath(options, 1 + 1e-4), {emitted_ps, 0}).value(),
                static_cast<double>(2 * flight_ps * rate), 1e-4);
  }
}

TEST(Echo, NoneFromBehindTheLidar) {
  EXPECT_FALSE(round_trip_ps(linear_motion(-1, 0), {}));
  EXPECT_FALSE(round_trip_ps(linear_motion(10, -5), FineTime{3'000'000'000'000, 0}));
  EXPECT_TRUE(round_trip_ps(linear_motion(10, -5), FineTime{1'000'000'000'000, 0}));
}

TEST(Echo, KeepsItsDigitsAfterAMonth) {
  const double start_ps = round_trip_ps(linear_motion(284.5, 0), {}).value();
  const FineTime month{2'600'000'000'000'000'000, 0};
  EXPECT_NEAR(round_trip_ps(linear_motion(284.5, 0), month).value(), start_ps, 1e-6);
}

}  // namespace
}  // namespace splid::simulator
