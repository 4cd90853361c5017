#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"
#include "tests/support/several_scene.hpp"

// Targets that stand in a row, each close to the next.

namespace splid {
namespace {

using test::expect_is;
using test::off_of;
using test::scene_of;
using test::several;

// Of three targets that stand close to each other two alone do not fit, so that none is told from a
// wide pulse before all are known. (They used to be listed as one, in their middle.)
TEST(TargetsInRows, AreToldApartWhereTheLightFalls) {
  const double s = 60e-4;
  const std::vector<std::vector<test::FrameMaker>> rows = {
      {scene_of(0, 20, s), scene_of(0.4, 20, s), scene_of(0.8, 20, s)},
      {scene_of(0, 20, s), scene_of(0.5, 20, s), scene_of(1.0, 20, s), scene_of(1.5, 20, s)},
      {scene_of(0, 20, s), scene_of(0.7, 20, s), scene_of(1.1, 20, 0.8 * s)},
      {scene_of(0, 20, s), scene_of(0.5, 20, 0.3 * s), scene_of(3.0, 20, s)},
      {scene_of(0, 20, 33e-4), scene_of(0.5, 20, 10e-4), scene_of(1.0, 20, 3.3e-4)}};
  for (const std::vector<test::FrameMaker>& row : rows) {
    FrameEstimator estimator = several(row.front(), 4);
    const std::vector<test::FrameMaker> others(row.begin() + 1, row.end());
    int found = 0;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      const Estimate e = estimator.estimate(row.front().make_with(others, seed).view());
      if (e.target_count != row.size()) continue;
      ++found;
      for (const test::FrameMaker& truth : row) {
        const auto* const end = e.targets.begin() + e.target_count;
        const auto* const it = std::min_element(e.targets.begin(), end, [&](auto& a, auto& b) {
          return std::abs(off_of(a, truth)) < std::abs(off_of(b, truth));
        });
        expect_is(*it, truth);
      }
    }
    EXPECT_GE(found, 17) << row.size();
  }
}

// Beginning at three where two do not fit finds more rows that are hardly seen to fall between
// their targets: 32 of these 60 frames list all three, and 19 otherwise.
TEST(TargetsInRows, AreTriedAllAtOnce) {
  const double s = 33e-4;
  const test::FrameMaker first = scene_of(0, 20, s);
  FrameEstimator estimator = several(first, 3);
  int found = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const auto frame = first.make_with({scene_of(0.3, 20, s), scene_of(0.6, 20, s)}, seed);
    found += estimator.estimate(frame.view()).target_count == 3 ? 1 : 0;
  }
  EXPECT_GE(found, 26);
}

// What does not stand in one light is looked for one after the other, since the light that was
// fitted as a row may be that of others: of targets further apart, of such as part over the frame,
// of a pair beside a third, and of those whose combs meet, beside which there is a little light of
// none.
TEST(TargetsInRows, AreLookedForOneByOneWhereTheLightIsNotOne) {
  const double s = 13.5e-4;
  const auto of_three_rates = [](double off_ns, double signal) {
    test::FrameMaker made = scene_of(off_ns, 20, signal);
    made.pattern = test::interleaved_pattern({180000, 189000, 200000}, 37800000);
    return made;
  };
  const std::vector<std::vector<test::FrameMaker>> scenes = {
      {scene_of(0, 20, 2 * s), scene_of(0.28, 20, 1.5 * s), scene_of(1, 20, 2 * s)},
      {scene_of(0, 20, 2 * s), scene_of(-0.13, 12.5, 2 * s), scene_of(0.12, 28, 2 * s)},
      {scene_of(0, 20, 3 * s), scene_of(-0.86, 11, 3 * s), scene_of(-1.17, 11, 3 * s)},
      {of_three_rates(0, 1.41 * s), of_three_rates(-0.62, 1.96 * s),
       of_three_rates(377.65, 1.96 * s)}};
  for (const std::vector<test::FrameMaker>& scene : scenes) {
    FrameEstimator estimator = several(scene.front(), 4);
    const std::vector<test::FrameMaker> others(scene.begin() + 1, scene.end());
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      const Estimate e = estimator.estimate(scene.front().make_with(others, seed).view());
      EXPECT_EQ(e.target_count, scene.size()) << scene[1].distance_m - 284.5 << " " << seed;
    }
  }
}

}  // namespace
}  // namespace splid
