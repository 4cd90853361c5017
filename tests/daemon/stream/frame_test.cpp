#include "daemon/stream/frame.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace splid {
namespace {

Frame frame_of_100_ps(std::size_t losses = 8) {
  Frame frame(FrameCapacity{4, 4, 4, losses});
  frame.start_ps = 1000;
  frame.end_ps = 1100;
  return frame;
}

void expect_losses(const Frame& frame, const std::vector<Loss>& expected) {
  EXPECT_TRUE(std::ranges::equal(frame.losses.view(), expected));
}

TEST(FixedArray, NeverGrows) {
  FixedArray<int> array(2);
  EXPECT_TRUE(array.empty());
  EXPECT_TRUE(array.push(1));
  EXPECT_TRUE(array.push(2));
  EXPECT_FALSE(array.push(3));
  EXPECT_EQ(array.size(), 2U);
  EXPECT_EQ(array.back(), 2);
  EXPECT_TRUE(array.room().empty());
  array.clear();
  array.room()[0] = 7;
  array.grow(1);
  EXPECT_EQ(array.view()[0], 7);
}

TEST(Frame, WithoutLossesAllWasSeen) {
  Frame frame = frame_of_100_ps();
  frame.settle_losses();
  EXPECT_EQ(frame.seen_fraction, 1);
}

TEST(Frame, LossesAreSortedClippedAndJoined) {
  Frame frame = frame_of_100_ps();
  frame.add_loss(1090, 1200, 5);
  frame.add_loss(1020, 1030, 1);
  frame.add_loss(900, 1010, -1);
  frame.add_loss(1030, 1040, 2);
  frame.add_loss(1025, 1028, -1);
  frame.add_loss(1050, 1050, 9);  // empty
  frame.settle_losses();
  expect_losses(frame, {{1000, 1010, -1}, {1020, 1040, 3}, {1090, 1100, 5}});
  EXPECT_DOUBLE_EQ(frame.seen_fraction, 0.6);
}

TEST(Frame, UnknownCountsJoinedStayUnknown) {
  Frame frame = frame_of_100_ps();
  frame.add_loss(1000, 1010, -1);
  frame.add_loss(1005, 1020, -1);
  frame.settle_losses();
  expect_losses(frame, {{1000, 1020, -1}});
}

TEST(Frame, WithoutRoomTheLastLossGrows) {
  Frame frame = frame_of_100_ps(2);
  frame.add_loss(1000, 1010, 1);
  frame.add_loss(1020, 1030, 2);
  frame.add_loss(1050, 1060, 3);
  frame.settle_losses();
  expect_losses(frame, {{1000, 1010, 1}, {1020, 1060, 5}});
}

TEST(Frame, ViewShowsItsTags) {
  Frame frame = frame_of_100_ps();
  frame.photons_ps.push(1001);
  frame.add_loss(1010, 1020, 0);
  frame.sync.locked = true;
  const FrameView view = frame.view();
  EXPECT_EQ(view.start_ps, 1000);
  EXPECT_EQ(view.end_ps, 1100);
  ASSERT_EQ(view.photons_ps.size(), 1U);
  EXPECT_EQ(view.photons_ps[0], 1001);
  EXPECT_EQ(view.losses.size(), 1U);
  EXPECT_TRUE(view.sync.locked);
}

}  // namespace
}  // namespace splid
