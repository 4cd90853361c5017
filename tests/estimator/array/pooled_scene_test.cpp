#include "estimator/array/pooled_scene.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/allocation_count.hpp"
#include "tests/support/pixel_field.hpp"

namespace splid::array {
namespace {

using test::PixelField;

// 1.2 photons of signal and ten of background in each frame of a pixel.
test::FrameMaker faint() {
  test::FrameMaker made;
  made.pattern = test::random_pattern(3780000, 40, 9000, 5);
  made.velocity_mps = 12;
  made.signal_per_pulse = 1.2 / (50e6 / 3780 * 40);
  made.background_per_ns = 10 / 50e6;
  return made;
}

TEST(PooledScene, FaintPixelsAreMeasuredTogether) {
  PixelField field(20, faint());
  FrameEstimator alone(faint().pattern, {}, {}, {}, 50, 2000);
  PooledScene scene(faint().pattern, {}, {}, {}, 50, field.directions());
  std::vector<Estimate> estimates(field.size());
  std::vector<std::size_t> pooled(field.size());
  int found_alone = 0, found = 0, wrong = 0, of_nine = 0, all = 0;
  for (std::uint64_t n = 1; n <= 20; ++n) {
    const std::vector<FrameView>& views = field.next(n);
    for (std::size_t k = 0; k < field.size(); ++k) {
      estimates[k] = alone.estimate(views[k]);
      found_alone += estimates[k].status == FrameStatus::ok;
    }
    const std::uint64_t before = test::allocations;
    scene.estimate({views, estimates, pooled});
    EXPECT_EQ(test::allocations, before);
    for (std::size_t k = 0; k < field.size(); ++k) {
      ++all;
      if (estimates[k].status != FrameStatus::ok) continue;
      const bool is_right = field.is_right(estimates[k], k);
      found += is_right;
      wrong += !is_right;
      of_nine += pooled[k] <= 9;
      EXPECT_EQ(estimates[k].photons, views[k].photons_ps.size());
    }
  }
  EXPECT_LE(found_alone, all / 50);
  EXPECT_GE(found, 0.85 * all);
  EXPECT_GE(of_nine, 0.4 * all);  // the others are of 5 x 5
  EXPECT_LE(wrong, 2);
}

TEST(PooledScene, APixelThatShowsItsTargetIsLeftAlone) {
  test::FrameMaker bright = faint();
  bright.signal_per_pulse *= 100;
  PixelField field(8, bright);
  field.pixel(3).signal_per_pulse = 0;
  FrameEstimator alone(bright.pattern, {}, {}, {}, 50, 2000);
  PooledScene scene(bright.pattern, {}, {}, {}, 50, field.directions());
  const std::vector<FrameView>& views = field.next(1);
  std::vector<Estimate> estimates;
  for (const FrameView& view : views) estimates.push_back(alone.estimate(view));
  const std::vector<Estimate> before = estimates;
  std::vector<std::size_t> pooled(field.size());
  EXPECT_EQ(scene.estimate({views, estimates, pooled}), 1U);
  for (std::size_t k = 0; k < field.size(); ++k) {
    EXPECT_EQ(pooled[k], k == 3 ? 4U : 1U) << k;
    if (k == 3) continue;
    EXPECT_EQ(estimates[k].delay_ns, before[k].delay_ns) << k;
  }
  EXPECT_TRUE(field.is_right(estimates[3], 3));
}

TEST(PooledScene, DarknessStaysDark) {
  test::FrameMaker dark = faint();
  dark.signal_per_pulse = 0;
  PixelField field(8, dark);
  PooledScene scene(dark.pattern, {}, {}, {}, 50, field.directions());
  std::vector<Estimate> estimates(field.size());
  for (Estimate& estimate : estimates) estimate.status = FrameStatus::no_target;
  std::vector<std::size_t> pooled(field.size());
  EXPECT_EQ(scene.estimate({field.next(1), estimates, pooled}), 0U);
  for (const Estimate& estimate : estimates) EXPECT_EQ(estimate.status, FrameStatus::no_target);
}

}  // namespace
}  // namespace splid::array
