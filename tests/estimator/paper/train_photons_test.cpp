#include "estimator/paper/train_photons.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/estimator/paper/train_maker.hpp"

namespace splid::paper {
namespace {

TEST(Clusters, FindsTheHeaviestStretchOfTheCircle) {
  const std::vector<double> points = {10, 99.5, 0.5, 50, 50.4, 1.2};
  const std::vector<double> alike(points.size(), 1);
  const Cluster around = find_largest_cluster(points, alike, 100, 2);
  EXPECT_DOUBLE_EQ(around.begin_ns, 99.5);
  EXPECT_DOUBLE_EQ(around.weight, 3);
  EXPECT_NEAR(around.middle_ns, 0.4, 1e-12);
  const Cluster heavy = find_largest_cluster(points, {1, 1, 1, 5, 5, 1}, 100, 2);
  EXPECT_NEAR(heavy.middle_ns, 50.2, 1e-12);
  EXPECT_DOUBLE_EQ(heavy.weight, 10);
  EXPECT_EQ(find_largest_cluster({}, {}, 100, 2).weight, 0);
}

TEST(Clusters, IsTheLargestOfAllWindows) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> anywhere(0, 180);
  std::vector<double> points(300);
  for (double& point : points) point = anywhere(random);
  const std::vector<double> alike(points.size(), 1);
  for (const double width : {0.01, 3.0, 100.0, 179.0}) {
    double most = 0;
    for (const double begin : points) {
      double inside = 0;
      for (const double point : points) inside += fold_on(point - begin, 180) <= width ? 1 : 0;
      most = std::max(most, inside);
    }
    EXPECT_EQ(find_largest_cluster(points, alike, 180, width).weight, most);
  }
}

TEST(Clusters, KeepsThePhotonsOfTheLargestAlone) {
  TrainPhotons photons;
  photons.period_ns = 180;
  photons.counted = 5;
  photons.phase_ns = {179.8, 20, 0.1, 90, 0.3};
  photons.time_ns = {1, 2, 3, 4, 5};
  keep_largest_cluster(photons, 1);
  EXPECT_EQ(photons.time_ns, (std::vector<double>{1, 3, 5}));
  EXPECT_EQ(photons.phase_ns, (std::vector<double>{179.8, 0.1, 0.3}));
  EXPECT_EQ(photons.counted, 5);
  keep_largest_cluster(photons, 180);
  EXPECT_EQ(photons.size(), 3U);
}

TEST(FoldedPeak, FindsDelaySignalAndBackgroundOfAMovingTarget) {
  const auto shape = make_gaussian(0.1);
  test::TrainMaker made;
  made.signal = 900;
  made.length_ns = 5e6;
  made.background_per_ns = 2e-4;
  // The last lies across the period's end.
  for (const double delay_ns : {61.3, 30.0, 94.47}) {
    made.delay_ns = delay_ns;
    const auto peak = find_folded_peak(made.make(1), made.velocity_mps, *shape);
    ASSERT_TRUE(peak);
    // Five standard deviations of a mean of 900 photons, and of counts.
    EXPECT_LT(std::abs(std::remainder(peak->delay_ns - delay_ns, 94.5)), 5 * 0.1 / 30);
    EXPECT_NEAR(peak->signal_per_pulse, 900 / (5e6 / 94.5), 5 * 30 / (5e6 / 94.5));
    EXPECT_NEAR(peak->background_per_ns, 2e-4, 5 * std::sqrt(2e-4 / 5e6));
  }
}

TEST(FoldedPeak, ATabulatedPulseIsPlacedByItsPeak) {
  TabulatedPulse table;
  table.first_ps = 200;
  table.step_ps = 50;
  for (int i = 0; i < 13; ++i) table.density.push_back(std::exp(-0.5 * (i - 6) * (i - 6) / 4.0));
  const auto shape = make_tabulated(table);
  const test::TrainMaker made;
  const auto peak = find_folded_peak(made.make(1), made.velocity_mps, *shape);
  EXPECT_NEAR(peak->delay_ns, made.delay_ns - 0.5, 0.1);
}

TEST(FoldedPeak, IsNotThereWithoutPhotonsOrRoomForThem) {
  const auto shape = make_gaussian(0.1);
  test::TrainMaker made;
  TrainPhotons photons = made.make(1);
  photons.phase_ns.clear();
  photons.time_ns.clear();
  EXPECT_FALSE(find_folded_peak(photons, 0, *shape));
  made.period_ns = 1.5;
  EXPECT_FALSE(find_folded_peak(made.make(1), 0, *shape));
  made.background_per_ns = 0;
  made.period_ns = 94.5;
  const auto alone = find_folded_peak(made.make(1), made.velocity_mps, *shape);
  ASSERT_TRUE(alone);
  EXPECT_GE(alone->background_per_ns, 0);
  EXPECT_GT(alone->signal_per_pulse, 0);
}

}  // namespace
}  // namespace splid::paper
