#include "protocol/pattern.hpp"

#include <gtest/gtest.h>

namespace splid {
namespace {

TEST(Pattern, ModesHaveNames) {
  const char* names[] = {"baseline", "ambiguous", "mrr", "random", "interleaved"};
  for (int i = 0; i < 5; ++i) {
    EXPECT_STREQ(to_string(static_cast<Mode>(i)), names[i]);
    EXPECT_EQ(mode_from_string(names[i]), static_cast<Mode>(i));
  }
  EXPECT_EQ(mode_from_string("Random"), std::nullopt);
  EXPECT_EQ(mode_from_string(""), std::nullopt);
}

TEST(Pattern, PeriodAndPulsesOfOneSegmentLeaveRepeatsOut) {
  Pattern pattern;
  pattern.segments = {{1'000.5, {0, 1, 2}, {1, 1, 1}, 7}};
  EXPECT_EQ(pattern_period_ps(pattern), 1'000.5);
  EXPECT_EQ(pulses_per_period(pattern), 3U);
}

TEST(Pattern, PeriodAndPulsesOfSeveralSegmentsAddUp) {
  Pattern pattern;
  pattern.segments = {{10, {0}, {1}, 3}, {12.5, {0, 5}, {1, 1}, 2}};
  EXPECT_EQ(pattern_period_ps(pattern), 55);
  EXPECT_EQ(pulses_per_period(pattern), 7U);
}

}  // namespace
}  // namespace splid
