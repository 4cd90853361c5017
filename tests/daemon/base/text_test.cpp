#include "daemon/base/text.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <ctime>

namespace splid {
namespace {

TEST(Text, ATimeIsThatOfAClock) {
  ::setenv("TZ", "UTC-2", 1);  // two hours before UTC
  ::tzset();
  EXPECT_EQ(clock_time(0), "02:00:00.000");
  EXPECT_EQ(clock_time(1764293395.1234), "03:29:55.123");
  EXPECT_EQ(clock_time(1764293395.9999), "03:29:56.000");
  EXPECT_EQ(clock_time(-0.25), "01:59:59.750");
  ::unsetenv("TZ");
  ::tzset();
}

}  // namespace
}  // namespace splid
