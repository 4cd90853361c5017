#include "estimator/sync/sync_survey.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/sync_stream.hpp"

namespace splid {
namespace {

using test::SyncStream;

std::optional<MeasuredPeriod> survey_of(const std::vector<std::int64_t>& syncs_ps) {
  SyncSurvey survey;
  for (const std::int64_t sync_ps : syncs_ps) survey.take(sync_ps);
  return survey.finish();
}

// Within its own deviation, as often as that says, and of a deviation that is worth its digits.
void expect_found(SyncStream stream, double most_std_ps) {
  double squares = 0;
  constexpr int trials = 8;
  for (std::uint64_t seed = 1; seed <= trials; ++seed) {
    stream.seed = seed;
    const auto found = survey_of(stream.make());
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->period_ps, stream.period_ps, 5 * found->std_period_ps);
    EXPECT_LT(found->std_period_ps, most_std_ps);
    const double off = (found->period_ps - stream.period_ps) / found->std_period_ps;
    squares += off * off;
  }
  // The mean of 8 squares is 1 +- 0.5.
  EXPECT_GT(squares / trials, 0.05);
  EXPECT_LT(squares / trials, 4);
}

TEST(SyncSurvey, OfACleanStream) {
  SyncStream stream;
  stream.period_ps = 3'780'007.56;
  stream.end_ps = 300'000'000'000;
  expect_found(stream, 2e-3);
}

// 512 gaps of these are off by 1.5 to 12.6 ppm: 5.7 to 48 ps.
TEST(SyncSurvey, OfDoubledMissingAndStraySyncs) {
  SyncStream stream;
  stream.period_ps = 3'780'007.56;
  stream.end_ps = 300'000'000'000;
  stream.doubled = 0.3;
  stream.missing = 0.3;
  stream.strays = 0.02;
  expect_found(stream, 2e-3);
}

TEST(SyncSurvey, OfAFastLaserWithFewOfItsSyncs) {
  SyncStream stream;
  stream.period_ps = 12'512.6258;
  stream.missing = 0.97;
  stream.doubled = 0;
  stream.end_ps = 20'000'000'000;
  expect_found(stream, 2e-3);
}

TEST(SyncSurvey, OfSlowSyncs) {
  SyncStream stream;
  stream.period_ps = 1e9 + 1234.5;
  stream.jitter_ps = 20;
  stream.end_ps = 30'000'000'000'000;
  expect_found(stream, 0.5);
}

TEST(SyncSurvey, GoesOnWhereTheClockIsSetAnew) {
  SyncStream stream;
  stream.begin_ps = 900'000'000'000;
  stream.end_ps = 1'000'000'000'000;
  std::vector<std::int64_t> syncs_ps = stream.make();
  stream.begin_ps = 0;
  stream.end_ps = 100'000'000'000;
  stream.phase_ps = 999'999;
  for (const std::int64_t sync_ps : stream.make()) syncs_ps.push_back(sync_ps);
  const auto found = survey_of(syncs_ps);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->period_ps, stream.period_ps, 5 * found->std_period_ps);
}

// Half a period later in 150 ms would be 12.6 ppm, with a deviation of nothing.
TEST(SyncSurvey, GoesOnWhereTheGeneratorBeginsAgain) {
  SyncStream stream;
  stream.end_ps = 150'000'000'000;
  std::vector<std::int64_t> syncs_ps = stream.make();
  stream.begin_ps = stream.end_ps;
  stream.end_ps = 300'000'000'000;
  stream.phase_ps = 1'900'000;
  for (const std::int64_t sync_ps : stream.make()) syncs_ps.push_back(sync_ps);
  const auto found = survey_of(syncs_ps);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->period_ps, stream.period_ps, 5 * found->std_period_ps);
  EXPECT_LT(found->std_period_ps, 0.01);
}

// Whether the pattern played on meanwhile, and how many periods that took, nobody knows: the phases
// of either side may fit by chance, and then say another period.
TEST(SyncSurvey, PausesSayNothingOfThePeriod) {
  for (const double pause_s : {0.5, 2.0, 9.0, 10.1, 30.0, 1000.0}) {
    for (int eighths = 0; eighths < 8; ++eighths) {
      SyncStream stream;
      stream.period_ps = 3'780'007.56;
      stream.end_ps = 300'000'000'000;
      std::vector<std::int64_t> syncs_ps = stream.make();
      stream.begin_ps = stream.end_ps + static_cast<std::int64_t>(pause_s * 1e12);
      stream.end_ps += stream.begin_ps;
      stream.phase_ps += stream.period_ps * eighths / 8;
      stream.seed = 2;
      for (const std::int64_t sync_ps : stream.make()) syncs_ps.push_back(sync_ps);
      const auto found = survey_of(syncs_ps);
      ASSERT_TRUE(found);
      EXPECT_NEAR(found->period_ps, stream.period_ps, 5 * found->std_period_ps)
          << pause_s << " s, " << eighths;
      EXPECT_LT(found->std_period_ps, 1e-3);
    }
  }
}

TEST(SyncSurvey, OfNothingRegularIsNone) {
  EXPECT_FALSE(survey_of({}));
  EXPECT_FALSE(survey_of({1, 2}));
  SyncStream random;
  random.missing = 1;
  random.strays = 1;
  EXPECT_FALSE(survey_of(random.make()));
}

TEST(SyncSurvey, StandsTimesOfADamagedRecording) {
  constexpr std::int64_t first = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t last = std::numeric_limits<std::int64_t>::max();
  std::vector<std::int64_t> syncs_ps = {first, last, first, last};
  for (std::int64_t i = 0; i < 1'000; ++i) syncs_ps.push_back(last - i);
  for (std::int64_t i = 0; i < 1'000; ++i) syncs_ps.push_back(first + i * 100'000);
  (void)survey_of(syncs_ps);
}

}  // namespace
}  // namespace splid
