#include "estimator/paper/clusters.hpp"

#include <gtest/gtest.h>

#include <random>

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

}  // namespace
}  // namespace splid::paper
