#include "drivers/idq/join.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace splid::idq {
namespace {

using Account = Join::Account;
using ::testing::ElementsAre;

constexpr std::int64_t longest_ps = 1'000'000'000;

std::string message(const Times& times) {
  return {reinterpret_cast<const char*>(times.data()), times.size() * sizeof times[0]};
}

void expect_part(Join& join, std::int64_t index, const std::vector<Times>& times, bool lacks) {
  const auto part = join.take();
  ASSERT_TRUE(part) << index;
  EXPECT_EQ(part->index, index);
  EXPECT_EQ(part->of_input, times);
  EXPECT_EQ(part->lacks, lacks);
}

TEST(Join, ASubAcquisitionIsWholeOnceAllInputsAreCounted) {
  Join join(2, longest_ps);
  EXPECT_TRUE(join.add(0, message({1, 2})));
  EXPECT_TRUE(join.add(1, message({3})));
  EXPECT_FALSE(join.take());
  EXPECT_EQ(join.settle(0, 1, 2), Account::settled);
  EXPECT_FALSE(join.take());
  EXPECT_EQ(join.settle(1, 1, 1), Account::settled);
  expect_part(join, 0, {{1, 2}, {3}}, false);
  EXPECT_FALSE(join.take());
}

// Whether it sends an empty message or none.
TEST(Join, AnInputThatSeesNothingKeepsItsPlace) {
  Join join(1, longest_ps);
  EXPECT_EQ(join.settle(0, 1, 0), Account::settled);
  EXPECT_TRUE(join.add(0, ""));
  EXPECT_EQ(join.settle(0, 2, 0), Account::settled);
  EXPECT_TRUE(join.add(0, message({7})));
  EXPECT_EQ(join.settle(0, 3, 1), Account::settled);
  expect_part(join, 0, {{}}, false);
  expect_part(join, 1, {{}}, false);
  expect_part(join, 2, {{7}}, false);
  EXPECT_TRUE(join.add(0, ""));
  EXPECT_EQ(join.settle(0, 5, 1), Account::settled);
  expect_part(join, 3, {{}}, false);
  expect_part(join, 4, {{}}, false);
}

TEST(Join, MessagesAndCountsMayComeInAnyOrder) {
  Join join(1, longest_ps);
  EXPECT_EQ(join.settle(0, 2, 3), Account::open);
  EXPECT_TRUE(join.add(0, message({1, 2})));
  EXPECT_EQ(join.settle(0, 2, 3), Account::open);
  EXPECT_TRUE(join.add(0, message({5})));
  EXPECT_EQ(join.settle(0, 2, 3), Account::settled);
  EXPECT_TRUE(join.add(0, message({6})));
  EXPECT_EQ(join.settle(0, 2, 3), Account::open);  // not counted yet
  EXPECT_EQ(join.settle(0, 2, 4), Account::open);  // its end is not
  EXPECT_EQ(join.settle(0, 3, 4), Account::settled);
  expect_part(join, 0, {{1, 2}}, false);
  expect_part(join, 1, {{5}}, false);
  expect_part(join, 2, {{6}}, false);
}

TEST(Join, WhatDoesNotComeIsLacking) {
  Join join(2, longest_ps);
  EXPECT_TRUE(join.add(1, message({9})));
  EXPECT_EQ(join.settle(0, 1, 5), Account::open);
  EXPECT_EQ(join.settle(1, 1, 1), Account::settled);
  EXPECT_EQ(join.give_up(0), 1);
  expect_part(join, 0, {{}, {9}}, true);
  EXPECT_TRUE(join.add(0, message({4})));
  EXPECT_EQ(join.settle(0, 2, 6), Account::settled);
  EXPECT_EQ(join.settle(1, 2, 1), Account::settled);
  expect_part(join, 1, {{4}, {}}, false);
}

// Two sub-acquisitions and one message: nothing tells which of them saw nothing.
TEST(Join, AMessageThatFitsTwoPlacesIsLacking) {
  Join join(1, longest_ps);
  EXPECT_TRUE(join.add(0, message({9})));
  EXPECT_EQ(join.settle(0, 2, 1), Account::settled);
  expect_part(join, 0, {{}}, true);
  expect_part(join, 1, {{}}, true);
}

TEST(Join, LostTimesMayBeOfThoseNotTakenAndOfTheNext) {
  Join join(1, longest_ps);
  EXPECT_EQ(join.settle(0, 1, 0), Account::settled);
  expect_part(join, 0, {{}}, false);
  EXPECT_EQ(join.settle(0, 2, 0), Account::settled);
  join.doubt();
  EXPECT_EQ(join.settle(0, 4, 0), Account::settled);
  expect_part(join, 1, {{}}, true);
  expect_part(join, 2, {{}}, true);
  expect_part(join, 3, {{}}, false);
}

TEST(Join, CountsThatFallAreOfAnotherMeasurement) {
  Join join(1, longest_ps);
  EXPECT_TRUE(join.add(0, message({9})));
  EXPECT_EQ(join.settle(0, 3, 1), Account::settled);
  EXPECT_EQ(join.settle(0, 2, 1), Account::fell);
  EXPECT_EQ(join.settle(0, 3, 0), Account::fell);
}

TEST(Join, WhatIsNoListOfTimesIsRefused) {
  Join join(1, longest_ps);
  EXPECT_FALSE(join.add(0, "1234567"));
  EXPECT_FALSE(join.add(0, message({longest_ps + 1})));
  EXPECT_TRUE(join.add(0, message({longest_ps})));
  EXPECT_FALSE(join.add(0, message({2'000'000, 999'999})));
  EXPECT_TRUE(join.add(0, message({2'000'000, 1'000'000})));
}

}  // namespace
}  // namespace splid::idq
