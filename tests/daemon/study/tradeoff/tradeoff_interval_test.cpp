#include "daemon/study/tradeoff/tradeoff_interval.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace splid::tradeoff {
namespace {

// Ten blocks whose mean squares are 0.5 and 1.5 in turn: a deviation of 1/6 of their mean, which is
// 72 degrees of freedom, and 2.26 for the t of nine.
TEST(TradeoffInterval, IsThatOfAChiSquare) {
  std::vector<double> without;
  for (int block = 0; block < 10; ++block) without.push_back((10 - (0.5 + block % 2)) / 9);
  const auto interval = interval_of_rms(1, without);
  ASSERT_TRUE(interval);
  EXPECT_NEAR(interval->low, 0.841, 0.001);
  EXPECT_NEAR(interval->high, 1.230, 0.001);
  // With three quarters of the variance between blocks, the deviation is twice as large.
  const auto wider = interval_of_rms(2, without, 0.75);
  ASSERT_TRUE(wider);
  EXPECT_DOUBLE_EQ(wider->low, interval->low);
  EXPECT_DOUBLE_EQ(wider->high, interval->high);
}

TEST(TradeoffInterval, IsNoneWhereTooLittleIsKnown) {
  EXPECT_FALSE(interval_of_rms(1, {}));
  EXPECT_FALSE(interval_of_rms(1, std::vector{1.0, 1.1}));
  EXPECT_FALSE(interval_of_rms(1, std::vector{0.1, 1.0, 2.0})) << "one block has it all";
}

}  // namespace
}  // namespace splid::tradeoff
