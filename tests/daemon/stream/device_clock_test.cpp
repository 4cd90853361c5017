#include "daemon/stream/device_clock.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tests/support/held_clock.hpp"

namespace splid {
namespace {

constexpr std::int64_t ms_ps = 1'000'000'000;
constexpr std::int64_t clock_second_ps = 1000 * ms_ps;

// Frames of 50 ms of a tagger's clock that runs fast by `ppm`, each late by up to 40 ms.
struct SyncTags {
  explicit SyncTags(const SourceInfo& source) : device(source, host) { device.anchor(now_ps); }

  void run(double seconds) {
    for (std::int64_t frame = 0; frame < static_cast<std::int64_t>(seconds * 20); ++frame) {
      host.advance_ms(50);
      now_ps += 50 * ms_ps + static_cast<std::int64_t>(ppm * 50'000);
      const double before_s = device.unix_s(now_ps);
      const std::int64_t late_ms = 10 * (frame % 5);
      device.follow(now_ps - late_ms * ms_ps);
      largest_step_s = std::max(largest_step_s, std::abs(device.unix_s(now_ps) - before_s));
    }
  }
  [[nodiscard]] double error_s() const { return device.unix_s(now_ps) - host.unix_s(); }

  HeldClock host;
  std::int64_t now_ps = 340'000 * clock_second_ps;
  double ppm = 0;
  double largest_step_s = 0;
  DeviceClock device;
};

const SourceInfo live{"live", true, {}};

TEST(DeviceClock, FollowsTheHostsClockForADay) {
  for (const double ppm : {10.0, -90.0}) {
    SyncTags stream(live);
    stream.ppm = ppm;
    stream.run(86'400);
    EXPECT_NEAR(stream.error_s(), 0, 0.001) << ppm;
    EXPECT_LT(stream.largest_step_s, 0.00011) << ppm;
  }
}

TEST(DeviceClock, WhatComesLateMovesItSlowly) {
  SyncTags stream(live);
  stream.host.advance_ms(8000);  // a ring that is full
  stream.run(60);
  EXPECT_NEAR(stream.error_s(), -8, 0.007);
  stream.device.anchor(stream.now_ps);
  EXPECT_NEAR(stream.error_s(), 0, 1e-6);
}

TEST(DeviceClock, AClockThatWasSetIsTakenAsItIs) {
  SyncTags stream(live);
  stream.now_ps += 337'000 * clock_second_ps;
  stream.run(1.1);
  EXPECT_NEAR(stream.error_s(), 0, 1e-6);
  stream.host.advance_ms(3'600'000);  // the host's was wrong before
  stream.run(1.1);
  EXPECT_NEAR(stream.error_s(), 0, 1e-6);
}

TEST(DeviceClock, ARecordingsTimesAreItsOwn) {
  for (const SourceInfo& source :
       {SourceInfo{"replay", false, 1.6e9}, SourceInfo{"live that knows", true, 1.6e9}}) {
    SyncTags stream(source);
    stream.ppm = 10;
    stream.run(10);
    EXPECT_EQ(stream.device.unix_s(0), 1.6e9);
  }
  SyncTags nowhen({"replay", false, {}});
  nowhen.run(10);
  EXPECT_EQ(nowhen.device.unix_s(50 * ms_ps), 0.05);
}

}  // namespace
}  // namespace splid
