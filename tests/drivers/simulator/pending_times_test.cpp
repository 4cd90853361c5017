#include "drivers/simulator/pending_times.hpp"

#include <gtest/gtest.h>

namespace splid::simulator {
namespace {

TEST(PendingTimes, HandsOnInOrder) {
  PendingTimes pending;
  EXPECT_EQ(pending.front(), PendingTimes::none);
  for (const int time : {5, 3, 9, 4}) pending.insert(time);
  EXPECT_EQ(pending.front(), 3);
  pending.pop();
  pending.compact();
  pending.insert(1);
  for (const int time : {1, 4, 5, 9}) {
    EXPECT_EQ(pending.front(), time);
    pending.pop();
  }
  EXPECT_EQ(pending.front(), PendingTimes::none);
}

// What was handed on is over, even where a later time would belong before it.
TEST(PendingTimes, DoesNotSortBehindWhatWasPopped) {
  PendingTimes pending;
  pending.insert(10);
  pending.pop();
  pending.insert(7);
  EXPECT_EQ(pending.front(), 7);
}

}  // namespace
}  // namespace splid::simulator
