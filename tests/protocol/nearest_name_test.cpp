#include "protocol/nearest_name.hpp"

#include <gtest/gtest.h>

#include <array>

namespace splid {
namespace {

constexpr std::array<const char*, 5> names = {"period_ps", "pulse_times_ps", "amplitudes",
                                              "repeats", "v"};

TEST(NearestName, FindsSlipsOfTyping) {
  EXPECT_STREQ(nearest_name("perod_ps", names), "period_ps");
  EXPECT_STREQ(nearest_name("peroid_ps", names), "period_ps");
  EXPECT_STREQ(nearest_name("period_ns", names), "period_ps");
  EXPECT_STREQ(nearest_name("pulse_time_ps", names), "pulse_times_ps");
  EXPECT_STREQ(nearest_name("amplitude", names), "amplitudes");
  EXPECT_STREQ(nearest_name("repeat", names), "repeats");
  EXPECT_STREQ(nearest_name("repeats", names), "repeats");
}

TEST(NearestName, NullWhereNoneIsNear) {
  EXPECT_EQ(nearest_name("colour", names), nullptr);
  EXPECT_EQ(nearest_name("", names), nullptr);
  EXPECT_EQ(nearest_name("x", names), nullptr);
  // Half of the letters are others: no slip.
  constexpr std::array<const char*, 1> upload = {"upload"};
  EXPECT_EQ(nearest_name("plot", upload), nullptr);
  EXPECT_EQ(nearest_name("period_ps", {}), nullptr);
}

TEST(NearestName, ASwapCountsOnceAndTheFirstOfEqualsWins) {
  constexpr std::array<const char*, 2> pair = {"pusleab", "pulse"};
  EXPECT_STREQ(nearest_name("pusle", pair), "pulse");
  constexpr std::array<const char*, 2> equals = {"abcx", "abcy"};
  EXPECT_STREQ(nearest_name("abcz", equals), "abcx");
}

TEST(NearestName, Suggestion) {
  EXPECT_EQ(suggest_name("repeat", names), "; did you mean repeats?");
  EXPECT_EQ(suggest_name("colour", names),
            "; known are period_ps, pulse_times_ps, amplitudes, repeats, v");
  EXPECT_EQ(suggest_name("colour", {}), "");
}

}  // namespace
}  // namespace splid
