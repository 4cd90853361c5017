#include "drivers/simulator/sync_stream.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tests/support/scene_runs.hpp"

namespace splid::simulator {
namespace {

std::vector<std::int64_t> syncs(const SyncOptions& options, DriftRate drift, std::int64_t until_ps,
                                double period_ps = 1e6) {
  SyncStream stream(test::one_segment(period_ps, {0}, {1}), options, drift, 1);
  std::vector<std::int64_t> times;
  for (std::int64_t to_ps = until_ps / 10; to_ps <= until_ps; to_ps += until_ps / 10) {
    stream.fill(to_ps);
    for (; stream.pending().front() < to_ps; stream.pending().pop()) {
      times.push_back(stream.pending().front());
    }
  }
  return times;
}

SyncOptions exact() {
  SyncOptions options;
  options.jitter_ps = 0;
  return options;
}

TEST(SyncStream, OneAtTheStartOfEachPeriod) {
  const auto times = syncs(exact(), {}, 1'000'000'000, 3'780'000);
  ASSERT_EQ(times.size(), 265U);
  for (std::size_t i = 0; i < times.size(); ++i) {
    EXPECT_EQ(times[i], static_cast<std::int64_t>(i) * 3'780'000);
  }
}

TEST(SyncStream, DriftMovesThem) {
  const auto times = syncs(exact(), {50, 0}, 1'000'000'000'000);
  EXPECT_EQ(times[100'000], 100'005'000'000);
}

TEST(SyncStream, JitterIsGaussianOfItsWidth) {
  SyncOptions options;
  options.jitter_ps = 500;
  const auto times = syncs(options, {}, 200'000'000'000);
  double squares = 0;
  double fourths = 0;
  for (const std::int64_t time : times) {
    const double off_ps =
        static_cast<double>(time) - 1e6 * std::round(static_cast<double>(time) / 1e6);
    squares += off_ps * off_ps;
    fourths += std::pow(off_ps, 4);
  }
  const double count = static_cast<double>(times.size());
  EXPECT_NEAR(std::sqrt(squares / count), 500, 4);
  EXPECT_NEAR(fourths / count / std::pow(squares / count, 2), 3, 0.1);
}

// Each sync is in one of two states; each state has half of the time, in stays of 10 ms.
TEST(SyncStream, JumpsBetweenTwoStates) {
  SyncOptions options = exact();
  options.jump_ps = 250;
  options.jump_every_ms = 0.1;
  const auto times = syncs(options, {}, 1'000'000'000'000);
  ASSERT_EQ(times.size(), 1'000'000U);
  double late = 0, jumps = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const std::int64_t off_ps = times[i] - static_cast<std::int64_t>(i) * 1'000'000;
    ASSERT_TRUE(off_ps == 0 || off_ps == 250) << off_ps;
    late += off_ps > 0 ? 1 : 0;
    if (i > 0) jumps += times[i] - times[i - 1] != 1'000'000 ? 1 : 0;
  }
  EXPECT_NEAR(late / 1e6, 0.5, 4 * std::sqrt(0.25 / 5000));
  // Of stays shorter than a period, 1 % of a mean stay, some are not seen.
  EXPECT_NEAR(jumps, 1e4, 4 * 100 + 100);
}

TEST(SyncStream, JitterBeyondAPeriodStaysSorted) {
  SyncOptions options;
  options.jitter_ps = 1'000'000;
  const auto times = syncs(options, {}, 1'000'000'000);
  EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
  EXPECT_NEAR(static_cast<double>(times.size()), 1000, 20);
}

TEST(SyncStream, SomeAreMissing) {
  SyncOptions options = exact();
  options.missing_fraction = 0.25;
  const auto times = syncs(options, {}, 100'000'000'000);
  EXPECT_NEAR(static_cast<double>(times.size()), 75'000, 600);
  for (const std::int64_t time : times) ASSERT_EQ(time % 1'000'000, 0);
}

TEST(SyncStream, SomeAreDoubled) {
  SyncOptions options = exact();
  options.doubled_fraction = 0.1;
  const auto times = syncs(options, {}, 100'000'000'000);
  EXPECT_NEAR(static_cast<double>(times.size()), 110'000, 400);
  for (const std::int64_t time : times) {
    const std::int64_t late_ps = time % 1'000'000;
    if (late_ps == 0) continue;
    ASSERT_GE(late_ps, 1'000);
    ASSERT_LE(late_ps, 50'000);
  }
}

}  // namespace
}  // namespace splid::simulator
