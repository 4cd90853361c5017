#include "protocol/text.hpp"

#include <gtest/gtest.h>

namespace splid {
namespace {

TEST(Trimmed, LeavesWhatStandsBetween) {
  EXPECT_EQ(trimmed(" \ta b\r\n"), "a b");
  EXPECT_EQ(trimmed("'a'", "'"), "a");
  EXPECT_EQ(trimmed(" \n"), "");
  EXPECT_EQ(trimmed(""), "");
}

TEST(WholeNumber, TakesAllOrNothing) {
  EXPECT_EQ(whole_number("-9223372036854775808"), INT64_MIN);
  EXPECT_EQ(whole_number("0"), 0);
  for (const char* text : {"", "-", "+1", "1 ", " 1", "0x10", "1e3", "9223372036854775808"}) {
    EXPECT_FALSE(whole_number(text)) << text;
  }
}

}  // namespace
}  // namespace splid
