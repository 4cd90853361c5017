#include "estimator/sync/sync_clock.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/real_recording.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/support/sync_stream.hpp"

namespace splid {
namespace {

using test::SyncStream;

constexpr double period_ps = 3'780'000;
constexpr std::size_t max_syncs = 1 << 16;

SyncFit fit_of(const SyncStream& stream, DriftMethod method = DriftMethod::regression,
               double calibrated_ps = period_ps) {
  SyncClock clock(calibrated_ps, method, max_syncs);
  return clock.fit(stream.make(), stream.begin_ps, stream.end_ps);
}

// How far the fit's pattern starts are from the stream's, near mid-frame.
double phase_error_ps(const SyncFit& fit, const SyncStream& stream) {
  const double truth = static_cast<double>(stream.begin_ps - fit.origin_ps) + stream.phase_ps;
  return std::remainder(fit.phase_ps - truth, stream.period_ps);
}

void expect_true_to(const SyncFit& fit, const SyncStream& stream) {
  ASSERT_TRUE(fit.locked);
  EXPECT_NEAR(fit.period_ps, stream.period_ps, 5 * fit.std_period_ps + 1e-7);
  EXPECT_NEAR(phase_error_ps(fit, stream), 0, 5 * fit.std_phase_ps + 0.01);
  EXPECT_LE(std::abs(fit.phase_ps), fit.period_ps);
}

TEST(SyncClock, FindsPeriodPhaseAndJitterOfACleanStream) {
  const SyncStream stream;
  const SyncFit fit = fit_of(stream);
  expect_true_to(fit, stream);
  EXPECT_NEAR(fit.jitter_ps, 10, 0.5);
  EXPECT_NEAR(fit.drift_ppm, 0, 1e-3);
  EXPECT_EQ(fit.count, 13'228U);
  EXPECT_EQ(fit.missing, 0U);
  EXPECT_LE(fit.spurious, 1U);  // beyond 5 sigma
  // 10 ps over 13,228 syncs, by the textbook's formulas.
  EXPECT_NEAR(fit.std_phase_ps, 10 / std::sqrt(13'228.0), 0.005);
  EXPECT_NEAR(fit.std_period_ps, 10 * std::sqrt(12.0 / std::pow(13'228.0, 3)), 1e-6);
}

// Syncs that are 250 ps late for parts of the frame: either place may be the right one.
TEST(SyncClock, SyncsThatJumpLeaveTheClockUncertain) {
  const SyncStream stream;
  for (const double late_share : {0.2, 0.5, 0.8}) {
    std::vector<std::int64_t> syncs = stream.make();
    const auto quarter = syncs.size() / 4;
    for (std::size_t i = 0; i < syncs.size(); ++i) {
      const double within = static_cast<double>(i % quarter) / static_cast<double>(quarter);
      if (within < late_share) syncs[i] += 250;
    }
    SyncClock clock(period_ps, DriftMethod::regression, max_syncs);
    const SyncFit fit = clock.fit(syncs, stream.begin_ps, stream.end_ps);
    ASSERT_TRUE(fit.locked);
    EXPECT_EQ(fit.curvature_ps, 0);
    EXPECT_NEAR(fit.std_phase_ps, 125, 40) << late_share;
    EXPECT_LT(std::abs(phase_error_ps(fit, stream)), 3 * fit.std_phase_ps) << late_share;
    EXPECT_LT(std::abs(fit.period_ps - stream.period_ps), 3 * fit.std_period_ps) << late_share;
  }
}

TEST(SyncClock, CountsFromAnEpochFarFromZero) {
  SyncStream stream;
  stream.begin_ps = 340'000'000'000'000'123;
  stream.end_ps = stream.begin_ps + 50'000'000'000;
  expect_true_to(fit_of(stream), stream);
}

TEST(SyncClock, LocksWithDriftUpToItsBound) {
  for (const double ppm : {-400.0, -100.0, -1.0, 0.01, 30.0, 100.0, 400.0}) {
    SyncStream stream;
    stream.period_ps = period_ps * (1 + ppm * 1e-6);
    const SyncFit fit = fit_of(stream);
    expect_true_to(fit, stream);
    EXPECT_NEAR(fit.drift_ppm, ppm, 1e-4);
  }
}

TEST(SyncClock, DoesNotLockBeyondItsBound) {
  for (const double other_ps : {3'770'000.0, 3'784'000.0, 1'890'000.0, 2'520'000.0, 7'000'000.0}) {
    SyncStream stream;
    stream.period_ps = other_ps;
    const SyncFit fit = fit_of(stream);
    EXPECT_FALSE(fit.locked) << other_ps;
    EXPECT_EQ(fit.count, stream.make().size());
  }
}

TEST(SyncClock, DoesNotLockToRandomTags) {
  SyncStream stream;
  stream.missing = 1;
  stream.strays = 1;
  EXPECT_FALSE(fit_of(stream).locked);
  stream.period_ps = 12'512;
  stream.end_ps = 1'000'000'000;
  EXPECT_FALSE(fit_of(stream, DriftMethod::regression, 12'512).locked);
}

TEST(SyncClock, MissingSyncsAreCountedByTime) {
  for (const double missing : {0.01, 0.3, 0.9, 0.99}) {
    SyncStream stream;
    stream.missing = missing;
    stream.period_ps *= 1 + 50e-6;
    const SyncFit fit = fit_of(stream);
    expect_true_to(fit, stream);
    EXPECT_NEAR(static_cast<double>(fit.missing + fit.count - fit.spurious), 13'227, 1.5);
  }
}

TEST(SyncClock, GapsTooLongToCountAtFirstCountOnceThePeriodIsKnownBetter) {
  // 2000 periods between syncs: at 500 ppm that is one more or less.
  for (int seed = 1; seed <= test::times(20); ++seed) {
    SyncStream stream;
    stream.missing = 0.9995;
    stream.jitter_ps = 200;
    stream.period_ps *= 1 + 100e-6;
    stream.end_ps = 4'000'000'000'000;
    stream.seed = seed;
    SCOPED_TRACE(seed);
    expect_true_to(fit_of(stream), stream);
  }
}

TEST(SyncClock, StraysAreRejectedAndCounted) {
  SyncStream stream;
  stream.strays = 0.3;
  stream.missing = 0.1;
  const SyncFit fit = fit_of(stream);
  expect_true_to(fit, stream);
  EXPECT_NEAR(fit.jitter_ps, 10, 1);
  EXPECT_NEAR(static_cast<double>(fit.spurious), 0.3 * 13'228, 200);
}

TEST(SyncClock, OfADoubleTheFirstIsTheSync) {
  constexpr std::array<double, 4> after_ps{300, 3'000, 20'000, 200'000};
  for (const double doubled : {0.05, 1.0}) {
    for (std::uint64_t seed = 1; seed < 20; ++seed) {
      SyncStream stream;
      stream.double_after_ps = after_ps[seed % 4];
      stream.doubled = doubled;
      stream.seed = seed;
      stream.phase_ps = 0;  // so that a double may stand first
      const SyncFit fit = fit_of(stream);
      expect_true_to(fit, stream);
      EXPECT_NEAR(fit.jitter_ps, 10, 0.5);
      EXPECT_NEAR(static_cast<double>(fit.spurious), doubled * 13'228, 100);
    }
  }
}

TEST(SyncClock, OfTwoSyncsInThePeriodTheNearerIsKept) {
  SyncStream stream;
  std::vector<std::int64_t> syncs = stream.make();
  const std::int64_t at = syncs[5000];
  syncs.insert(syncs.begin() + 5001, at + 15);
  SyncClock clock(period_ps, DriftMethod::regression, max_syncs);
  const SyncFit fit = clock.fit(syncs, stream.begin_ps, stream.end_ps);
  expect_true_to(fit, stream);
  EXPECT_GE(fit.spurious, 1U);
  EXPECT_EQ(fit.missing, 0U);
}

TEST(SyncClock, StartsFromAnotherSyncWhereTheFirstAreStray) {
  const SyncStream stream;
  std::vector<std::int64_t> syncs = stream.make();
  for (const std::int64_t off : {100'000, 500'000, 770'000}) syncs.push_back(off);
  std::sort(syncs.begin(), syncs.end());
  SyncClock clock(period_ps, DriftMethod::regression, max_syncs);
  const SyncFit fit = clock.fit(syncs, stream.begin_ps, stream.end_ps);
  expect_true_to(fit, stream);
  EXPECT_GE(fit.spurious, 3U);
}

TEST(SyncClock, LargeJitter) {
  SyncStream stream;
  stream.jitter_ps = 500;
  const SyncFit fit = fit_of(stream);
  expect_true_to(fit, stream);
  EXPECT_NEAR(fit.jitter_ps, 500, 15);
}

TEST(SyncClock, NoJitterAtAll) {
  SyncStream stream;
  stream.jitter_ps = 0;
  stream.phase_ps = 0;
  const SyncFit fit = fit_of(stream);
  ASSERT_TRUE(fit.locked);
  EXPECT_DOUBLE_EQ(fit.period_ps, period_ps);
  EXPECT_EQ(fit.spurious, 0U);
  EXPECT_LT(fit.jitter_ps, 1e-3);
}

TEST(SyncClock, FewSyncs) {
  SyncClock clock(period_ps, DriftMethod::regression, max_syncs);
  const std::vector<std::int64_t> syncs = {1'000, 3'781'003, 7'560'998};
  for (std::size_t n = 0; n < 3; ++n) {
    const SyncFit fit = clock.fit(std::span(syncs).first(n), 0, 10'000'000);
    EXPECT_FALSE(fit.locked);
    EXPECT_EQ(fit.count, n);
  }
  const SyncFit fit = clock.fit(syncs, 0, 10'000'000);
  ASSERT_TRUE(fit.locked);
  EXPECT_NEAR(fit.period_ps, period_ps, 10);
  EXPECT_TRUE(std::isfinite(fit.std_phase_ps));
}

TEST(SyncClock, SyncsAllAtOneTimeDoNotLock) {
  SyncClock clock(period_ps, DriftMethod::regression, max_syncs);
  EXPECT_FALSE(clock.fit(std::vector<std::int64_t>(100, 5'000), 0, 10'000'000).locked);
}

TEST(SyncClock, EndpointsUsesTheFirstAndTheLast) {
  const SyncStream stream;
  const std::vector<std::int64_t> syncs = stream.make();
  const SyncFit fit = fit_of(stream, DriftMethod::endpoints);
  ASSERT_TRUE(fit.locked);
  // [P] Eq. 19 by hand.
  const double by_hand = static_cast<double>(syncs.back() - syncs.front()) / 13'227.0;
  EXPECT_NEAR(fit.period_ps, by_hand, 1e-7);
  const double first = static_cast<double>(syncs.front() - fit.origin_ps);
  EXPECT_NEAR(std::remainder(first - fit.phase_ps, fit.period_ps), 0, 1e-3);
  EXPECT_NEAR(fit.std_period_ps, 10 * std::sqrt(2.0) / 13'227, 1e-4);
}

TEST(SyncClock, OffKeepsTheCalibratedPeriodAndTheMeanPhase) {
  SyncStream stream;
  stream.period_ps *= 1 + 1e-9;
  const SyncFit fit = fit_of(stream, DriftMethod::off);
  ASSERT_TRUE(fit.locked);
  EXPECT_DOUBLE_EQ(fit.period_ps, period_ps);
  EXPECT_EQ(fit.std_period_ps, 0);
  EXPECT_NEAR(fit.drift_ppm, 0, 1e-9);
  // The line through mid-frame is right there, whatever the slope.
  EXPECT_NEAR(phase_error_ps(fit, stream), 0, 1);
}

TEST(SyncClock, RegressionsOwnErrorBarsAreTrue) {
  double squares_period = 0;
  double squares_phase = 0;
  constexpr int trials = 200;
  for (int i = 0; i < trials; ++i) {
    SyncStream stream;
    stream.seed = static_cast<std::uint64_t>(i);
    stream.end_ps = 2'000'000'000;
    stream.missing = 0.2;
    const SyncFit fit = fit_of(stream);
    squares_period += std::pow((fit.period_ps - stream.period_ps) / fit.std_period_ps, 2);
    squares_phase += std::pow(phase_error_ps(fit, stream) / fit.std_phase_ps, 2);
  }
  EXPECT_NEAR(squares_period / trials, 1, 0.3);  // 3 sigma of a chi-square with 200 degrees
  EXPECT_NEAR(squares_phase / trials, 1, 0.3);
}

TEST(SyncClock, MoreSyncsThanItHoldsAreThinned) {
  const SyncStream stream;
  SyncClock clock(period_ps, DriftMethod::regression, 1000);
  const SyncFit fit = clock.fit(stream.make(), stream.begin_ps, stream.end_ps);
  expect_true_to(fit, stream);
  EXPECT_EQ(fit.count, 13'228U);
  EXPECT_LE(fit.missing, 30U);
  EXPECT_LE(fit.spurious, 30U);
}

TEST(SyncClock, RemembersThePeriodUntilReset) {
  SyncStream stream;
  stream.period_ps *= 1 + 80e-6;
  SyncClock clock(period_ps, DriftMethod::regression, max_syncs);
  EXPECT_EQ(clock.period_ps(), period_ps);
  ASSERT_TRUE(clock.fit(stream.make(), stream.begin_ps, stream.end_ps).locked);
  EXPECT_NEAR(clock.period_ps(), stream.period_ps, 1e-3);
  // With the period known, gaps of thousands of periods count right from the first.
  stream.missing = 0.9995;
  const SyncFit sparse = clock.fit(stream.make(), stream.begin_ps, stream.end_ps);
  expect_true_to(sparse, stream);
  clock.reset();
  EXPECT_EQ(clock.period_ps(), period_ps);
}

TEST(SyncClock, FollowsAPeriodThatJumps) {
  SyncClock clock(period_ps, DriftMethod::regression, max_syncs);
  for (const double ppm : {0.0, 100.0, -100.0}) {
    SyncStream stream;
    stream.period_ps = period_ps * (1 + ppm * 1e-6);
    expect_true_to(clock.fit(stream.make(), stream.begin_ps, stream.end_ps), stream);
  }
}

TEST(SyncClock, SyncsOutOfOrderByAMicrosecond) {
  const SyncStream stream;
  std::vector<std::int64_t> syncs = stream.make();
  std::swap(syncs[1000], syncs[1001]);
  std::swap(syncs[13'000], syncs[13'001]);
  SyncClock clock(period_ps, DriftMethod::regression, max_syncs);
  expect_true_to(clock.fit(syncs, stream.begin_ps, stream.end_ps), stream);
}

std::vector<std::int64_t> real_syncs(const std::filesystem::path& file) {
  std::vector<std::int64_t> syncs;
  for (const Tag& tag : test::ptu_tags(file)) {
    if (tag.kind == TagKind::sync) syncs.push_back(tag.time_ps);
  }
  return syncs;
}

TEST(SyncClock, EveryFrameOfARealTaggerHasItsPeriodAndJitter) {
  const auto file = test::real_recording_path("qutag_sync_t2.ptu");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not here; set SPLID_DATA";
  const std::vector<std::int64_t> syncs = real_syncs(file);
  ASSERT_EQ(syncs.size(), 105'600U);
  constexpr std::int64_t frame_ps = 50'000'000'000;
  for (const double calibrated_ps : {12'512.62584, 12'512.0, 12'513.5, 12'507.0}) {
    SyncClock clock(calibrated_ps, DriftMethod::regression, max_syncs);
    int frames = 0;
    for (std::int64_t begin = syncs.front(); begin + frame_ps <= syncs.back(); begin += frame_ps) {
      const auto low = std::lower_bound(syncs.begin(), syncs.end(), begin);
      const auto high = std::lower_bound(low, syncs.end(), begin + frame_ps);
      const SyncFit fit = clock.fit({low, high}, begin, begin + frame_ps);
      ASSERT_TRUE(fit.locked) << calibrated_ps << " frame " << frames;
      EXPECT_NEAR(fit.period_ps, 12'512.626, 0.005);
      EXPECT_GT(fit.jitter_ps, 9);
      EXPECT_LT(fit.jitter_ps, 12);
      EXPECT_LT(fit.spurious, fit.count / 100);
      ++frames;
    }
    EXPECT_EQ(frames, 5);
  }
}

// 1 ppm/s over 50 ms: the syncs at either end come 312.5 ps after those of a steady clock.
TEST(SyncClock, ARateThatChangesBendsTheFit) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> jitter(0, 10);
  for (const double chirp_per_s : {1e-6, -1e-6, 0.0}) {
    std::vector<std::int64_t> syncs;
    for (int k = -6613; k < 6613; ++k) {
      const double at_ps = 3780000.0 * k;
      const double s = at_ps * 1e-12;
      syncs.push_back(std::llround(at_ps + 0.5 * chirp_per_s * s * s * 1e12 + jitter(random)));
    }
    const std::int64_t half_ps = 6613LL * 3780000;
    SyncClock clock(3780000, DriftMethod::regression, syncs.size());
    const SyncFit fit = clock.fit(syncs, -half_ps, half_ps);
    ASSERT_TRUE(fit.locked);
    EXPECT_NEAR(fit.curvature_ps, chirp_per_s * 312.5e6, 1.5);
    EXPECT_NEAR(fit.jitter_ps, 10, 0.5);
    EXPECT_LE(fit.missing, 2U);  // at either end, where the curvature is largest
  }
}

}  // namespace
}  // namespace splid
