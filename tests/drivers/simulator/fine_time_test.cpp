#include "drivers/simulator/fine_time.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

namespace splid::simulator {
namespace {

TEST(FineTime, KeepsPartsOfAPicosecondAfterMonths) {
  FineTime time{8'000'000'000'000'000'000, 0};
  for (int i = 0; i < 1000; ++i) time.advance(0.001);
  EXPECT_NEAR(static_cast<double>(time.ps - 8'000'000'000'000'000'000) + time.fraction_ps, 1,
              1e-12);
}

TEST(FineTime, GoesBackwards) {
  const FineTime time = FineTime{10, 0.25}.after(-20.5);
  EXPECT_EQ(time.ps, -11);
  EXPECT_DOUBLE_EQ(time.fraction_ps, 0.75);
  EXPECT_EQ(time.rounded_ps(), -10);
  EXPECT_EQ((FineTime{3, 0}).after(-3).ps, 0);
}

TEST(FineTime, AStepBeyondAllStreamsLeadsToTheEndOfTime) {
  constexpr std::int64_t end_ps = std::numeric_limits<std::int64_t>::max();
  for (const double step_ps : {9e18, 1e19, std::numeric_limits<double>::infinity()}) {
    FineTime time{1'000'000'000'000'000'000, 0.5};
    time.advance_far(step_ps);
    EXPECT_EQ(time.rounded_ps(), end_ps);
    time.advance_far(1);
    EXPECT_EQ(time.rounded_ps(), end_ps);
  }
  FineTime time{1, 0.5};
  time.advance_far(2.25);
  EXPECT_EQ(time.ps, 3);
  EXPECT_DOUBLE_EQ(time.fraction_ps, 0.75);
}

TEST(FineTime, RoundsToTheNearest) {
  EXPECT_EQ((FineTime{7, 0.49}).rounded_ps(), 7);
  EXPECT_EQ((FineTime{7, 0.5}).rounded_ps(), 8);
}

}  // namespace
}  // namespace splid::simulator
