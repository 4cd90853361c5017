#include "daemon/stream/effort_governor.hpp"

#include <gtest/gtest.h>

namespace splid {
namespace {

// Frames without waiting until the effort changes, at most `most`.
int calm_until_change(EffortGovernor& governor, Effort from, int most = 10'000) {
  for (int frame = 1; frame <= most; ++frame) {
    if (governor.next(false) != from) return frame;
  }
  return -1;
}

TEST(EffortGovernor, FallsAtOnceAndComesBackAfterASecond) {
  EffortGovernor governor(Effort::balanced, true);
  EXPECT_EQ(governor.next(false), Effort::balanced);
  EXPECT_EQ(governor.next(true), Effort::fast);
  EXPECT_EQ(governor.next(true), Effort::fast);
  EXPECT_EQ(calm_until_change(governor, Effort::fast), 20);
  EXPECT_EQ(calm_until_change(governor, Effort::balanced, 1000), -1);
}

TEST(EffortGovernor, IsMorePatientEachTimeThatItCameBackTooEarly) {
  EffortGovernor governor(Effort::balanced, true);
  (void)governor.next(true);
  int expected = 20;
  for (int times = 0; times < 9; ++times) {
    EXPECT_EQ(calm_until_change(governor, Effort::fast), expected);
    EXPECT_EQ(governor.next(true), Effort::fast);
    expected = std::min(2 * expected, 1280);
  }
}

TEST(EffortGovernor, ForgetsOnceItHasHeld) {
  EffortGovernor governor(Effort::balanced, true);
  (void)governor.next(true);
  (void)calm_until_change(governor, Effort::fast);
  (void)governor.next(true);  // too early: 40 next
  EXPECT_EQ(calm_until_change(governor, Effort::fast), 40);
  EXPECT_EQ(calm_until_change(governor, Effort::balanced, 100), -1);
  (void)governor.next(true);
  EXPECT_EQ(calm_until_change(governor, Effort::fast), 40);
  EXPECT_EQ(calm_until_change(governor, Effort::balanced, 100), -1);
}

TEST(EffortGovernor, LeavesAReplayAlone) {
  EffortGovernor governor(Effort::balanced, false);
  for (int frame = 0; frame < 10; ++frame) EXPECT_EQ(governor.next(true), Effort::balanced);
}

}  // namespace
}  // namespace splid
