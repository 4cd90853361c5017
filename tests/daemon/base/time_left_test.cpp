#include "daemon/base/time_left.hpp"

#include <gtest/gtest.h>

namespace splid {
namespace {

TimeLeft of_parts(std::initializer_list<double> expected_s) {
  TimeLeft left;
  for (const double seconds : expected_s) left.expect(seconds);
  return left;
}

// The parts that are yet to come count with their own times, not with those of the first.
TEST(TimeLeft, IsThatOfEachPart) {
  TimeLeft left = of_parts({1, 1, 98});
  EXPECT_DOUBLE_EQ(left.left_s(0, 0), 100);
  EXPECT_DOUBLE_EQ(left.left_s(0.5, 0.5), 99.5);
  left.finish(1);
  left.finish(1);
  EXPECT_DOUBLE_EQ(left.left_s(0, 0), 98);
  EXPECT_DOUBLE_EQ(left.left_s(1, 98), 0);
  left.finish(98);
  EXPECT_EQ(left.left_s(0, 0), 0);
}

TEST(TimeLeft, WhatIsDoneCorrectsWhatIsToComeTheMoreThereIsOfIt) {
  TimeLeft much = of_parts({90, 10});
  much.finish(180);
  EXPECT_NEAR(much.left_s(0, 0), 20, 1);
  TimeLeft little = of_parts({1, 99});
  little.finish(2);
  EXPECT_NEAR(little.left_s(0, 0), 1.17 * 99, 1);
}

// The more of a part is done, the more its own time counts.
TEST(TimeLeft, APartCorrectsItself) {
  const TimeLeft left = of_parts({10, 10});
  EXPECT_NEAR(left.left_s(0.9, 18), 10 + 0.1 * (18 + 0.1 * 10), 1e-9);
  EXPECT_DOUBLE_EQ(left.left_s(1, 20), 10);
}

TEST(TimeLeft, WhatIsLeftOutTellsNothing) {
  TimeLeft left = of_parts({5, 10});
  left.finish(0);
  EXPECT_DOUBLE_EQ(left.left_s(0, 0), 10);
  left.finish(3);
  left.finish(3);
  EXPECT_EQ(left.left_s(0.5, 1), 0);
}

}  // namespace
}  // namespace splid
