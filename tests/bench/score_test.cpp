#include "bench/studies/score.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace splid::studies {
namespace {

// The limits are the shares that are just 1.96 of their own deviations away from what was seen.
TEST(Wilson, LimitsAreSharesThatTheCountJustAllows) {
  for (const auto& [hits, trials] : {std::pair{0, 1000}, {1, 1000}, {10, 1600}, {50, 100}}) {
    const Share share = wilson_95(hits, trials);
    const double seen = static_cast<double>(hits) / trials;
    for (const double limit : {share.low, share.high}) {
      const double deviation = std::sqrt(limit * (1 - limit) / trials);
      EXPECT_NEAR(std::abs(seen - limit), 1.959964 * deviation, 1e-9) << hits << " of " << trials;
    }
    EXPECT_LE(share.low, seen);
    EXPECT_GE(share.high, seen);
  }
  EXPECT_NEAR(wilson_95(0, 1000).high, 0.003827, 1e-6);
  EXPECT_EQ(wilson_95(7, 7).high, 1);
}

TrialOutcome outcome(double delay_error, double deviation, double compute_ms) {
  TrialOutcome made;
  made.has_values = true;
  made.error = {delay_error, 2 * delay_error, 0, 0, 3 * delay_error};
  made.deviation = {deviation, deviation, 1, 1, 0};
  made.compute_ms = compute_ms;
  return made;
}

TEST(Score, WrongPeaksAndFramesWithoutValuesAreCountedAndLeftOut) {
  TrialOutcome none;
  none.compute_ms = 50;
  const Score found =
      score({outcome(0.03, 0.05, 1), outcome(-0.04, 0.03, 3), outcome(7, 0.1, 2), none}, 0.5);
  EXPECT_EQ(found.trials, 4);
  EXPECT_EQ(found.wrong, 1);
  EXPECT_EQ(found.no_value, 1);
  EXPECT_EQ(found.right(), 2);
  EXPECT_NEAR(found.rmse[delay], std::sqrt((0.0009 + 0.0016) / 2), 1e-15);
  EXPECT_NEAR(found.rmse[velocity], 2 * found.rmse[delay], 1e-15);
  EXPECT_NEAR(found.rmse[delay_start], 3 * found.rmse[delay], 1e-15);
  EXPECT_NEAR(found.rmse_all[delay], std::sqrt((0.0009 + 0.0016 + 49) / 3), 1e-15);
  EXPECT_EQ(found.inside_one[delay], 0.5);
  EXPECT_EQ(found.inside_two[delay], 1);
  EXPECT_EQ(found.inside_two[velocity], 0.5);
  EXPECT_EQ(found.with_deviation, 2);
  EXPECT_EQ(found.p50_ms, 2);
  EXPECT_EQ(found.p99_ms, 50);
  EXPECT_NEAR(found.relative_error(), 0.5, 1e-15);
}

TEST(Score, WrongPeaksOfFramesThatAreOkAreCountedApart) {
  TrialOutcome unsure = outcome(7, 0.1, 1);
  unsure.ambiguous = true;
  TrialOutcome lost = outcome(0.03, 0.05, 1);
  lost.ambiguous = true;
  // Wrong and sure of it; wrong and unsure; right and unsure; wide, and says so; right.
  const Score found = score(
      {outcome(7, 0.1, 1), unsure, lost, outcome(0.8, 0.5, 1), outcome(0.03, 0.05, 1), {}}, 0.5);
  EXPECT_EQ(found.wrong, 3);
  EXPECT_EQ(found.ambiguous, 2);
  EXPECT_EQ(found.wrong_ok, 1);
  EXPECT_EQ(found.ok(), 3);
}

TEST(Score, AnEstimatorWithoutDeviationsHasNoCoverage) {
  const Score found = score({outcome(0.03, 0, 1)}, 0.5);
  EXPECT_EQ(found.with_deviation, 0);
  EXPECT_EQ(found.right(), 1);
}

}  // namespace
}  // namespace splid::studies
