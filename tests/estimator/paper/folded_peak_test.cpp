#include "estimator/paper/folded_peak.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/estimator/paper/train_maker.hpp"

namespace splid::paper {
namespace {

TEST(FoldedPeak, FindsDelaySignalAndBackgroundOfAMovingTarget) {
  const auto shape = make_gaussian(0.1);
  test::TrainMaker made;
  made.signal = 900;
  made.length_ns = 5e6;
  made.background_per_ns = 2e-4;
  // The last lies across the period's end.
  for (const double delay_ns : {61.3, 30.0, 94.47}) {
    made.delay_ns = delay_ns;
    const FoldedPeak peak = find_folded_peak(made.make(1), made.velocity_mps, *shape);
    ASSERT_TRUE(peak.found);
    // Five standard deviations of a mean of 900 photons, and of counts.
    EXPECT_LT(std::abs(std::remainder(peak.delay_ns - delay_ns, 94.5)), 5 * 0.1 / 30);
    EXPECT_NEAR(peak.signal_per_pulse, 900 / (5e6 / 94.5), 5 * 30 / (5e6 / 94.5));
    EXPECT_NEAR(peak.background_per_ns, 2e-4, 5 * std::sqrt(2e-4 / 5e6));
  }
}

TEST(FoldedPeak, ATabulatedPulseIsPlacedByItsPeak) {
  TabulatedPulse table;
  table.first_ps = 200;
  table.step_ps = 50;
  for (int i = 0; i < 13; ++i) table.density.push_back(std::exp(-0.5 * (i - 6) * (i - 6) / 4.0));
  const auto shape = make_tabulated(table);
  const test::TrainMaker made;
  const FoldedPeak peak = find_folded_peak(made.make(1), made.velocity_mps, *shape);
  EXPECT_NEAR(peak.delay_ns, made.delay_ns - 0.5, 0.1);
}

TEST(FoldedPeak, IsNotThereWithoutPhotonsOrRoomForThem) {
  const auto shape = make_gaussian(0.1);
  test::TrainMaker made;
  TrainPhotons photons = made.make(1);
  photons.phase_ns.clear();
  photons.time_ns.clear();
  EXPECT_FALSE(find_folded_peak(photons, 0, *shape).found);
  made.period_ns = 1.5;
  EXPECT_FALSE(find_folded_peak(made.make(1), 0, *shape).found);
  made.background_per_ns = 0;
  made.period_ns = 94.5;
  const FoldedPeak alone = find_folded_peak(made.make(1), made.velocity_mps, *shape);
  EXPECT_TRUE(alone.found);
  EXPECT_GE(alone.background_per_ns, 0);
  EXPECT_GT(alone.signal_per_pulse, 0);
}

}  // namespace
}  // namespace splid::paper
