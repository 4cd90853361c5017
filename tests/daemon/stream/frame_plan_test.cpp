#include "daemon/stream/frame_plan.hpp"

#include <gtest/gtest.h>

#include <string>

#include "protocol/error.hpp"

namespace splid {
namespace {

Pattern pattern_of(double period_ps) {
  Pattern pattern;
  pattern.segments = {{period_ps, {0}, {1}, 0}};
  pattern.unambiguous_delay_ps = period_ps;
  return pattern;
}

TEST(FramePlan, PeriodsAreTheNearestWholeNumber) {
  EXPECT_EQ(periods_per_frame(50, 3'780'000), 13'228);  // 13,227.51
  EXPECT_EQ(periods_per_frame(1, 400'000'000), 3);      // 2.5
  EXPECT_EQ(periods_per_frame(1, 5'000'000'000), 1);    // 0.2: one at least
}

TEST(FramePlan, TheCalibratedPeriodCounts) {
  Pattern pattern = pattern_of(3'780'000);
  EXPECT_EQ((framer_options(50, pattern, DriftMethod::off, {}).period_ps), 3'780'000);
  pattern.calibrated_period_ps = 3'780'100;
  const FramerOptions options = framer_options(50, pattern, DriftMethod::off, {});
  EXPECT_EQ(options.period_ps, 3'780'100);
  EXPECT_EQ(options.length_ms, 50);
  EXPECT_EQ(options.drift, DriftMethod::off);
  EXPECT_GE(options.max_syncs, 2 * 13'228U);
}

TEST(FramePlan, CapacityHoldsTheRingsPhotonsAndTwiceTheSyncs) {
  EXPECT_EQ(frame_capacity(50, pattern_of(3'780'000), 4096, false).most_photons, 1U << 24);
  EXPECT_EQ(frame_capacity(50, pattern_of(3'780'000), 1U << 25, false).most_photons, 1U << 25);
  const FrameCapacity capacity = frame_capacity(50, pattern_of(3'780'000), 4096, true);
  EXPECT_EQ(capacity.photons, 4096U);
  EXPECT_GE(capacity.syncs, 2 * 13'228U);
}

TEST(FramePlan, ANewRingHasRoomForTheFullestFrame) {
  EXPECT_EQ(ring_needed(4096, 1, 4096), 8192U);
  EXPECT_EQ(ring_needed(4096, 5000, 4096), 16'384U);
  EXPECT_EQ(ring_needed(4095, 5000, 4096), 0U);  // lost elsewhere
  EXPECT_EQ(ring_needed(4096, 0, 4096), 0U);
  EXPECT_EQ(most_photons(4096, true), 4096U);
  EXPECT_EQ(most_photons(4096, false), most_waiting_photons);
}

TEST(FramePlan, AFrameThatTheRingCannotHoldIsRefused) {
  const Pattern pattern = pattern_of(1'000'000);  // 1 us: 1000 syncs a ms
  EXPECT_NO_THROW(check_frame_fits(1.024, pattern, 1024));
  try {
    check_frame_fits(2, pattern, 1024);
    FAIL() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::usage);
    EXPECT_EQ(
        std::string(error.what()),
        "/frame/length_ms: 2 ms is 2000 pattern periods, each with a sync, and the ring holds "
        "1024 tags: shorten it to 1.024 ms or less, or raise /pipeline/ring_capacity_tags to "
        "2000 or more");
  }
}

}  // namespace
}  // namespace splid
