#include "drivers/pace.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <stop_token>
#include <thread>

namespace splid {
namespace {

using std::chrono::steady_clock;

TEST(Pace, WaitsTheStreamsTimeOverTheSpeed) {
  const auto before = steady_clock::now();
  const Pace pace(4);
  EXPECT_TRUE(pace.wait_until(80'000'000'000, {}));
  EXPECT_GE(steady_clock::now() - before, std::chrono::milliseconds(20));
}

// Hours that it would otherwise wait for.
TEST(Pace, ZeroNeverWaits) { EXPECT_TRUE(Pace(0).wait_until(9'000'000'000'000'000'000, {})); }

TEST(Pace, AStopEndsAWaitOfDays) {
  const Pace pace(1e-6);
  std::stop_source stop;
  const std::jthread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    stop.request_stop();
  });
  EXPECT_FALSE(pace.wait_until(9'000'000'000'000'000'000, stop.get_token()));
}

TEST(Pace, AStopShowsWithoutWaiting) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(Pace(0).wait_until(0, stop.get_token()));
  EXPECT_FALSE(Pace(1).wait_until(0, stop.get_token()));
}

}  // namespace
}  // namespace splid
