#include "estimator/several/joint_bound.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

BoundScene bound_scene(double delay_ns, double velocity_mps, double signal) {
  return {5e6, 5e6, delay_ns, velocity_mps, signal, 1.75e-4};
}

void expect_same_bound(const Bound& a, const Bound& b, double within) {
  EXPECT_NEAR(a.delay_ns / b.delay_ns, 1, within);
  EXPECT_NEAR(a.delay_start_ns / b.delay_start_ns, 1, within);
  EXPECT_NEAR(a.velocity_mps / b.velocity_mps, 1, within);
  EXPECT_NEAR(a.signal_per_pulse / b.signal_per_pulse, 1, within);
  EXPECT_NEAR(a.background_per_ns / b.background_per_ns, 1, within);
}

TEST(JointBound, OfOneTargetIsTheBoundOfCramerAndRao) {
  const Pattern pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  const auto shape = make_gaussian(0.1);
  const BoundScene scene = bound_scene(1898, 31, 0.01);
  const std::vector<Bound> joint = joint_bound(pattern, *shape, std::span(&scene, 1));
  expect_same_bound(joint.front(), cramer_rao_bound(pattern, *shape, scene), 1e-3);
}

// Far apart, each target is as certain as alone, but for what the other takes of the dark time.
// Half a width apart, each hides the other.
TEST(JointBound, TargetsThatOverlapAreTheLessCertain) {
  const Pattern pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  const auto shape = make_gaussian(0.1);
  const BoundScene alone = bound_scene(1898, 31, 0.01);
  const Bound bound = cramer_rao_bound(pattern, *shape, alone);
  const BoundScene apart[] = {alone, bound_scene(1960.3, -20, 0.002)};
  expect_same_bound(joint_bound(pattern, *shape, apart).front(), bound, 0.02);
  const BoundScene close[] = {alone, bound_scene(1898.05, 31, 0.01)};
  const double worse = joint_bound(pattern, *shape, close).front().delay_ns / bound.delay_ns;
  EXPECT_GT(worse, 5);
  EXPECT_LT(worse, 100);
}

}  // namespace
}  // namespace splid
