#include "estimator/sync/recording_period.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>

namespace splid {
namespace {

constexpr double awg_period_ps = 3780007.56;

SyncFit fit_of(double off_ps, double std_ps) {
  SyncFit fit;
  fit.locked = true;
  fit.period_ps = awg_period_ps + off_ps;
  fit.std_period_ps = std_ps;
  return fit;
}

TEST(RecordingPeriod, IsTheMeanByTheFramesDeviations) {
  RecordingPeriod recording;
  EXPECT_EQ(recording.period().period_ps, 0);
  recording.add(SyncFit{});
  EXPECT_EQ(recording.period().period_ps, 0);
  recording.add(fit_of(0, 1e-3));
  EXPECT_EQ(recording.period().period_ps, awg_period_ps);
  EXPECT_NEAR(recording.period().std_period_ps, 1e-3, 1e-9);
  recording.add(fit_of(1e-3, 5e-4));
  EXPECT_NEAR(recording.period().period_ps, awg_period_ps + 8e-4, 1e-9);
}

TEST(RecordingPeriod, ItsDeviationIsTrue) {
  double squares = 0;
  constexpr int trials = 50;
  for (std::uint64_t seed = 1; seed <= trials; ++seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise(0, 1);
    RecordingPeriod recording;
    for (int f = 0; f < 480; ++f) recording.add(fit_of(2e-5 * noise(random), 2e-5));
    const MeasuredPeriod found = recording.period();
    EXPECT_NEAR(found.std_period_ps / (2e-5 / std::sqrt(480.0)), 1, 0.15);
    squares += std::pow((found.period_ps - awg_period_ps) / found.std_period_ps, 2) / trials;
  }
  EXPECT_NEAR(squares, 1, 0.6);  // 20 % for 50 values
}

// The period is known no better than the spread of the frames says.
TEST(RecordingPeriod, WanderOfTheClocksIsInTheDeviation) {
  RecordingPeriod recording;
  for (int f = 0; f < 100; ++f) recording.add(fit_of(0.02 * std::sin(f * 0.7), 2e-5));
  EXPECT_NEAR(recording.period().std_period_ps / (0.02 / std::sqrt(2.0) / 10), 1, 0.1);
}

TEST(RecordingPeriod, SyncsWithoutJitterHaveAPeriod) {
  RecordingPeriod recording;
  for (int f = 0; f < 3; ++f) recording.add(fit_of(0, 0));
  EXPECT_EQ(recording.period().period_ps, awg_period_ps);
}

}  // namespace
}  // namespace splid
