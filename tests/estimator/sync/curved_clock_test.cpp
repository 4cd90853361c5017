#include <gtest/gtest.h>

#include <cmath>

#include "estimator/sync/sync_clock.hpp"
#include "tests/support/sync_stream.hpp"

namespace splid {
namespace {

using test::SyncStream;

// A clock whose rate changes within the frame: its syncs lie on a parabola, so that those that
// deviate the most from a line are as true as all others.

SyncStream curved_stream(double length_ms, double ramp_ppm_per_s, double jitter_ps) {
  SyncStream stream;
  stream.end_ps = std::llround(length_ms * 1e9);
  stream.ramp_ppm_per_s = ramp_ppm_per_s;
  stream.jitter_ps = jitter_ps;
  return stream;
}

SyncFit curved_fit_of(const SyncStream& stream) {
  const auto syncs = stream.make();
  SyncClock clock(stream.period_ps, DriftMethod::regression, syncs.size());
  return clock.fit(syncs, stream.begin_ps, stream.end_ps);
}

// How much later the stream's pattern start near x is than the fit has it, x from -1 to 1.
double curved_error_ps(const SyncFit& fit, const SyncStream& stream, double x) {
  const double half_ps = static_cast<double>(stream.end_ps - stream.begin_ps) / 2;
  const double k = std::round((1 + x) * half_ps / stream.period_ps);
  const double start_ps = stream.clock_ps(stream.phase_ps + k * stream.period_ps) - half_ps;
  const double at = start_ps / half_ps;
  const double later_ps = fit.curvature_ps * (at * at - fit.curvature_zero);
  return std::remainder(start_ps - later_ps - fit.phase_ps, fit.period_ps);
}

void expect_bent_as(const SyncFit& fit, const SyncStream& stream) {
  ASSERT_TRUE(fit.locked);
  // Of a parabola the ends have three times the deviation of the mean.
  for (const double x : {-0.99, -0.5, 0.0, 0.5, 0.99}) {
    EXPECT_NEAR(curved_error_ps(fit, stream, x), 0, 15 * fit.std_phase_ps + 0.02) << x;
  }
  EXPECT_NEAR(fit.jitter_ps, std::hypot(stream.jitter_ps, 0.29), 0.06 * stream.jitter_ps + 0.1);
  EXPECT_NEAR(fit.std_phase_ps, fit.jitter_ps / std::sqrt(fit.count - fit.spurious), 0.03);
}

TEST(BentClock, AllItsSyncsAreRecognised) {
  struct Row {
    double length_ms, ramp_ppm_per_s, jitter_ps;
  };
  for (const Row& row :
       {Row{50, 1.5, 10}, Row{50, 0.3, 1}, Row{50, -1, 1}, Row{50, 10, 50}, Row{200, 0.05, 10},
        Row{200, 1, 10}, Row{500, 0.008, 10}, Row{1000, 0.002, 10}, Row{2000, 0.0005, 10}}) {
    const SyncStream stream = curved_stream(row.length_ms, row.ramp_ppm_per_s, row.jitter_ps);
    SCOPED_TRACE(testing::Message() << row.length_ms << " ms, " << row.ramp_ppm_per_s << " ppm/s");
    const SyncFit fit = curved_fit_of(stream);
    expect_bent_as(fit, stream);
    EXPECT_LE(fit.missing, 4U);
    EXPECT_LE(fit.spurious, 4U);
  }
}

TEST(BentClock, StraysAndMissingSyncsAreRejectedAndCounted) {
  for (const double fault : {0.01, 0.1, 0.3}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      SyncStream stream = curved_stream(50, 1.5, 10);
      stream.strays = fault;
      stream.missing = fault;
      stream.seed = seed;
      SCOPED_TRACE(testing::Message() << fault << " seed " << seed);
      const SyncFit fit = curved_fit_of(stream);
      expect_bent_as(fit, stream);
      EXPECT_NEAR(static_cast<double>(fit.spurious), fault * 13'228, 200);
      EXPECT_NEAR(static_cast<double>(fit.missing), fault * 13'228, 200);
    }
  }
}

TEST(BentClock, DoublesOfAllSyncsAreRejected) {
  SyncStream stream = curved_stream(50, 1.5, 10);
  stream.doubled = 1;
  stream.double_after_ps = 300;
  const SyncFit fit = curved_fit_of(stream);
  expect_bent_as(fit, stream);
  EXPECT_NEAR(static_cast<double>(fit.spurious), 13'228, 5);
}

// Slow syncs are not even about mid-frame: the last is a whole period before the end. The curvature
// must not pass for drift.
TEST(BentClock, OfSlowSyncsHasItsOwnPeriod) {
  double sum = 0;
  double squares = 0;
  constexpr int trials = 200;
  for (int i = 0; i < trials; ++i) {
    SyncStream stream = curved_stream(50, 1.5, 10);
    stream.period_ps = 1'020'600'000;
    stream.phase_ps = 0;
    stream.seed = static_cast<std::uint64_t>(i);
    const SyncFit fit = curved_fit_of(stream);
    ASSERT_TRUE(fit.locked);
    const double off = (fit.period_ps - stream.period_ps) / fit.std_period_ps;
    sum += off;
    squares += off * off;
  }
  EXPECT_NEAR(sum / trials, 0, 0.25);
  EXPECT_NEAR(squares / trials, 1, 0.35);
}

TEST(BentClock, ErrorBarsOfPeriodAndPhaseAreTrue) {
  double squares_period = 0;
  double squares_phase = 0;
  constexpr int trials = 200;
  for (int i = 0; i < trials; ++i) {
    SyncStream stream = curved_stream(50, 1.5, 10);
    stream.missing = 0.2;
    stream.strays = 0.05;
    stream.seed = static_cast<std::uint64_t>(i);
    const SyncFit fit = curved_fit_of(stream);
    ASSERT_TRUE(fit.locked);
    const double at = std::sqrt(fit.curvature_zero);
    const double late_ps = curved_error_ps(fit, stream, at);
    const double early_ps = curved_error_ps(fit, stream, -at);
    squares_phase += std::pow((late_ps + early_ps) / 2 / fit.std_phase_ps, 2);
    const double periods = 2 * at * 25e9 / fit.period_ps;
    squares_period += std::pow((late_ps - early_ps) / periods / fit.std_period_ps, 2);
  }
  EXPECT_NEAR(squares_period / trials, 1, 0.3);  // 3 sigma of a chi-square with 200 degrees
  EXPECT_NEAR(squares_phase / trials, 1, 0.3);
}

// What no parabola holds is held by the jitter that the fit states, and costs no syncs.
TEST(BentClock, AWanderIsSaidAsJitter) {
  for (const double wander_ps : {60.0, 1000.0}) {
    SyncStream stream = curved_stream(50, 0, 10);
    stream.wander_ps = wander_ps;
    const SyncFit fit = curved_fit_of(stream);
    ASSERT_TRUE(fit.locked);
    EXPECT_LE(fit.spurious, 4U);
    EXPECT_LE(fit.missing, 4U);
    // A sine's rms about its best line is 0.443 of its amplitude.
    EXPECT_NEAR(fit.jitter_ps, std::hypot(10, 0.443 * wander_ps), 0.02 * wander_ps);
  }
}

}  // namespace
}  // namespace splid
