#include "estimator/calibration/phase_histogram.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "estimator/sync/sync_line.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

test::FrameMaker drifting() {
  test::FrameMaker made;
  made.pattern = test::periodic_pattern(100000);
  made.drift_ppm = 50;
  made.distance_m = 3;
  made.signal_per_pulse = 0.02;
  made.background_per_ns = 0;
  made.length_ms = 5;
  return made;
}

TEST(PhaseHistogram, FoldsOnTheMeasuredPeriod) {
  test::FrameMaker made = drifting();
  PhaseHistogram fold(100000, 100);
  for (int n = 0; n < 2; ++n) {
    fold.add(made.make(static_cast<std::uint64_t>(n)).view());
    made.start_ps += 5'000'250'000;
  }
  EXPECT_NEAR(fold.period().period_ps, 100005, 1e-6);
  EXPECT_EQ(fold.bins(), 32000U);
  EXPECT_NEAR(fold.bin_ps(), 100005.0 / 32000, 1e-9);
  EXPECT_NEAR(fold.seconds(), 0.0100005, 1e-6);
  const auto& counts = fold.counts();
  ASSERT_EQ(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}), fold.photons());
  double moment = 0;
  for (std::size_t b = 0; b < counts.size(); ++b) {
    moment += counts[b] * (static_cast<double>(b) + 0.5) * fold.bin_ps();
  }
  // 2,000 photons of 100 ps: 2.2 ps.
  EXPECT_NEAR(moment / static_cast<double>(fold.photons()), 6 / 0.299792458 * 1e3, 9);
}

// A rate that changes within the frame moves its ends by the bend; a photon there is at phase 0 of
// the bent clock.
TEST(PhaseHistogram, FollowsABendingClock) {
  FrameView view{0, 2'000'000'000, {}, {}, {}};
  view.sync.locked = true;
  view.sync.origin_ps = 1'000'000'000;
  view.sync.period_ps = 100000;
  view.sync.bend_ps = 3000;
  view.sync.bend_zero = 1.0 / 3;
  const FramePhase phase(view);
  EXPECT_NEAR(phase.turn_of(2'000'002'000 + 25'000), 0.25, 1e-5);
  EXPECT_NEAR(phase.turn_of(2'000 + 25'000), 0.25, 1e-5);
  EXPECT_NEAR(phase.turn_of(1'000'000'000 - 1'000 + 25'000), 0.25, 1e-5);
}

TEST(PhaseHistogram, PassesOverFramesWithoutSyncAndLeavesOutLosses) {
  auto frame = drifting().make(1);
  PhaseHistogram fold(100000, 100);
  frame.sync.locked = false;
  fold.add(frame.view());
  EXPECT_EQ(fold.photons(), 0U);
  EXPECT_EQ(fold.period().period_ps, 0);
  frame.sync.locked = true;
  frame.losses = {{1'000'000'000, 2'000'000'000, 0}};
  fold.add(frame.view());
  EXPECT_NEAR(fold.seconds(), 0.00400025, 1e-6);
  EXPECT_EQ(fold.wrapped(-1), fold.bins() - 1);
  EXPECT_EQ(fold.wrapped(static_cast<std::ptrdiff_t>(fold.bins())), 0U);
}

SyncFit start_at(long double ps, double period_ps, double std_ps) {
  SyncFit fit;
  fit.locked = true;
  fit.origin_ps = static_cast<std::int64_t>(ps);
  fit.phase_ps = static_cast<double>(ps - static_cast<long double>(fit.origin_ps));
  fit.period_ps = period_ps;
  fit.std_phase_ps = std_ps;
  fit.std_period_ps = 1e-5;
  return fit;
}

constexpr double awg_period_ps = 3780007.56;

// Frames of 50 ms, with a start known to 0.2 ps each, a year into an instrument's clock.
SyncLine::Period period_of(int frames, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 1);
  SyncLine line;
  for (int f = 0; f < frames; ++f) {
    SyncFit fit = start_at(13228.0L * f * awg_period_ps + 0.2 * noise(random),
                           awg_period_ps + 1e-5 * noise(random), 0.2);
    fit.origin_ps += 340'000'000'000'000'000;
    line.add(fit);
  }
  return line.period();
}

TEST(SyncLine, PeriodAndItsDeviation) {
  double off = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto found = period_of(480, seed);
    // 0.2 ps sqrt(12 / n) over the recording's periods.
    EXPECT_NEAR(found.std_period_ps / (0.2 * std::sqrt(12.0 / 480) / (13228.0 * 480)), 1, 0.2);
    off += std::pow((found.period_ps - awg_period_ps) / found.std_period_ps, 2) / 20;
  }
  EXPECT_NEAR(std::sqrt(off), 1, 0.45);  // 16 % for 20 values
}

// 40 minutes: the product of count and period is 2.4e15 ps, which a double rounds to 0.5 ps. The
// period itself is rounded to 5e-10.
TEST(SyncLine, ALongRecordingLosesNothing) {
  EXPECT_NEAR(period_of(48'000, 5).period_ps, awg_period_ps, 1e-9);
}

TEST(SyncLine, AGapTooLongToCountAndAClockSetAnewBeginANewLine) {
  constexpr double period_ps = 100'000;
  SyncLine line;
  EXPECT_EQ(line.period().period_ps, 0);
  line.add(start_at(0, period_ps, 0.1));
  EXPECT_EQ(line.period().period_ps, period_ps);
  EXPECT_EQ(line.period().std_period_ps, 1e-5);
  const auto play = [&](double from_ps) {
    for (int f = 0; f < 10; ++f) line.add(start_at(from_ps + 1e9 * f, period_ps + 1e-5, 0.1));
  };
  play(1e9);
  // 2e9 periods known to 1e-5 ps each: no telling how many. Half a period off would show.
  play(2e14 + period_ps / 2);
  play(-1e12 + period_ps / 3);
  EXPECT_NEAR(line.period().period_ps, period_ps, 1e-6);
}

// Half a turn of wander in the phase: the line is known no better than what is left about it.
TEST(SyncLine, WanderOfTheClocksIsInTheDeviation) {
  SyncLine line;
  for (int f = 0; f < 100; ++f) {
    line.add(start_at(1e9 * f + 20 * std::sin(f * 0.7), 100'000, 0.1));
  }
  const double expected = 20 / std::sqrt(2.0) * std::sqrt(12.0 / 100) / (1e4 * 100);
  EXPECT_NEAR(line.period().std_period_ps / expected, 1, 0.1);
}

}  // namespace
}  // namespace splid
