#include "estimator/sync/recording_period.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>

namespace splid {
namespace {

// Of a frame of so many periods.
SyncFit start_at(long double ps, double period_ps, double std_ps, std::size_t periods = 10'000) {
  SyncFit fit;
  fit.locked = true;
  fit.origin_ps = static_cast<std::int64_t>(ps);
  fit.phase_ps = static_cast<double>(ps - static_cast<long double>(fit.origin_ps));
  fit.period_ps = period_ps;
  fit.std_phase_ps = std_ps;
  fit.std_period_ps = 1e-5;
  fit.count = periods;
  return fit;
}

constexpr double awg_period_ps = 3780007.56;

// Frames of 50 ms, with a start known to 0.2 ps each, a year into an instrument's clock.
MeasuredPeriod period_of(int frames, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 1);
  RecordingPeriod line;
  for (int f = 0; f < frames; ++f) {
    SyncFit fit = start_at(13228.0L * f * awg_period_ps + 0.2 * noise(random),
                           awg_period_ps + 1e-5 * noise(random), 0.2, 13'228);
    fit.origin_ps += 340'000'000'000'000'000;
    line.add(fit);
  }
  return line.period();
}

TEST(RecordingPeriod, PeriodAndItsDeviation) {
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
TEST(RecordingPeriod, ALongRecordingLosesNothing) {
  EXPECT_NEAR(period_of(48'000, 5).period_ps, awg_period_ps, 1e-9);
}

TEST(RecordingPeriod, AGapTooLongToCountAndAClockSetAnewBeginANewLine) {
  constexpr double period_ps = 100'000;
  RecordingPeriod line;
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

// 5 ns later after 0.9 s would be 5.6e-9 of the period, with a deviation of 1e-14 and less.
TEST(RecordingPeriod, APauseAndAGeneratorThatBeganAgainBeginANewLine) {
  constexpr double period_ps = 100'000;
  for (const double pause_ps : {0.0, 9e11}) {
    RecordingPeriod line;
    for (int f = 0; f < 20; ++f) {
      const double later_ps = f < 10 ? 0 : pause_ps + 5'000;
      line.add(start_at(1e9 * f + later_ps, period_ps, 0.1));
    }
    EXPECT_NEAR(line.period().period_ps, period_ps, 5 * line.period().std_period_ps) << pause_ps;
    // 0.1 ps sqrt(12 / n) over each line's periods; two lines.
    EXPECT_NEAR(line.period().std_period_ps / (0.1 * std::sqrt(12.0 / 990) / 1e4 / std::sqrt(2.0)),
                1, 0.01);
  }
}

// Frames by themselves say no more of the period than their syncs do.
TEST(RecordingPeriod, FramesBetweenPausesAreAveraged) {
  RecordingPeriod line;
  for (int f = 0; f < 9; ++f) {
    line.add(start_at(1e11 * f + 777.0 * f, 100'000 + (f % 3 - 1) * 1e-5, 0.1));
  }
  EXPECT_NEAR(line.period().period_ps, 100'000, 1e-9);
  EXPECT_NEAR(line.period().std_period_ps / (1e-5 / 3), 1, 1e-6);
}

// Half a turn of wander in the phase: the line is known no better than what is left about it.
TEST(RecordingPeriod, WanderOfTheClocksIsInTheDeviation) {
  RecordingPeriod line;
  for (int f = 0; f < 100; ++f) {
    line.add(start_at(1e9 * f + 20 * std::sin(f * 0.7), 100'000, 0.1));
  }
  const double expected = 20 / std::sqrt(2.0) * std::sqrt(12.0 / 100) / (1e4 * 100);
  EXPECT_NEAR(line.period().std_period_ps / expected, 1, 0.1);
}

}  // namespace
}  // namespace splid
