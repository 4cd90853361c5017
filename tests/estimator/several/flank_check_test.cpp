#include "estimator/several/flank_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace splid {
namespace {

// The light of a gaussian pulse at a place, as wide as that, in the bins.
FlankCheck::Bins flank_light(double at_widths, double wide, double photons) {
  FlankCheck::Bins light;
  const auto below = [&](double x) {
    return 0.5 * std::erfc(-(x - at_widths) / wide / std::numbers::sqrt2);
  };
  for (std::size_t i = 0; i < light.size(); ++i) {
    const double begin = FlankCheck::first_widths + static_cast<double>(i) * FlankCheck::bin_widths;
    light[i] = photons * (below(begin + FlankCheck::bin_widths) - below(begin));
  }
  return light;
}

FlankCheck::Bins sum_of(std::initializer_list<FlankCheck::Bins> parts, double background) {
  FlankCheck::Bins sum;
  sum.fill(background);
  for (const FlankCheck::Bins& part : parts) {
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += part[i];
  }
  return sum;
}

// Exact counts, without noise: what each explanation lacks is its own.
TEST(FlankCheck, TellsATargetFromAPulseOfAnotherShape) {
  const auto shape = make_gaussian(0.1);
  FlankCheck check(*shape);
  const FlankCheck::Bins bright = flank_light(0, 1, 3000);
  const FlankCheck::Bins weak = flank_light(4, 1, 150);
  for (const double side : {-1.0, 1.0}) {
    EXPECT_GT(check.nats_for_target(sum_of({bright, weak}, 2), side, weak, {}), 10);
    EXPECT_LT(check.nats_for_target(sum_of({flank_light(0, 1.4, 3000)}, 2), side, weak, {}), -5);
  }
  // A tail of 3 widths, which is between two of those that are tried. No pulse has it before.
  FlankCheck::Bins tail{};
  for (double late = 0.05; late < 30; late += 0.1) {
    const FlankCheck::Bins part = flank_light(late, 1, 375 * 0.1 / 3 * std::exp(-late / 3));
    tail = sum_of({tail, part}, 0);
  }
  EXPECT_LT(check.nats_for_target(sum_of({bright, tail}, 2), 1, weak, {}), -5);
  EXPECT_GT(check.nats_for_target(sum_of({bright, tail}, 2), -1, weak, {}), 10);
}

// The light of a third target is neither a tail nor the second target.
TEST(FlankCheck, LightOfOtherTargetsIsKnown) {
  const auto shape = make_gaussian(0.1);
  FlankCheck check(*shape);
  const FlankCheck::Bins weak = flank_light(4, 1, 150), third = flank_light(8, 1, 600);
  const FlankCheck::Bins counts = sum_of({flank_light(0, 1, 3000), weak, third}, 2);
  const double known = check.nats_for_target(counts, 1, weak, {&third, 1});
  EXPECT_GT(known, 10);
  EXPECT_LT(check.nats_for_target(counts, 1, weak, {}), known);
}

}  // namespace
}  // namespace splid
