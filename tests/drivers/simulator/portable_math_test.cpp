#include "drivers/simulator/portable_math.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace splid::simulator {
namespace {

TEST(PortableMath, LogarithmAgreesWithTheLibrarys) {
  for (double x = 1e-300; x < 1e300; x *= 1.37) {
    EXPECT_NEAR(portable_log(x), std::log(x), 4e-16 * std::abs(std::log(x)) + 3e-16) << x;
  }
  EXPECT_EQ(portable_log(1), 0);
  EXPECT_NEAR(portable_log(1 + 1e-9), std::log(1 + 1e-9), 1e-24);
}

TEST(PortableMath, SineAndCosineAgreeWithTheLibrarys) {
  for (double turns = -2.3; turns < 2.3; turns += 0.0137) {
    EXPECT_NEAR(sin_turns(turns), std::sin(2 * std::numbers::pi * turns), 2e-15) << turns;
    EXPECT_NEAR(cos_turns(turns), std::cos(2 * std::numbers::pi * turns), 2e-15) << turns;
  }
  EXPECT_EQ(sin_turns(1'000'000), 0);
  EXPECT_NEAR(cos_turns(1'000'000), 1, 1e-15);
}

}  // namespace
}  // namespace splid::simulator
