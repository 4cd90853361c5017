#include "estimator/pulse_finder.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

PulseFinder fold(const test::FrameMaker& made, int frames) {
  PulseFinder finder(made.pattern.segments.front().period_ps, made.sigma_ns * 1e3);
  for (int n = 0; n < frames; ++n) {
    finder.add(made.make(static_cast<std::uint64_t>(n)).view());
  }
  return finder;
}

TEST(PulseFinder, FindsThePulsesThatWerePlayed) {
  test::FrameMaker made;
  made.pattern = test::random_pattern(1000000, 12, 9000, 4);
  auto& segment = made.pattern.segments.front();
  for (std::size_t p = 0; p < segment.amplitudes.size(); ++p) {
    segment.amplitudes[p] = p % 2 == 0 ? 1.4 : 0.6;
  }
  made.distance_m = 0;
  made.signal_per_pulse = 0.02;
  const auto found = fold(made, 4).find();
  ASSERT_EQ(found.size(), 12U);
  for (std::size_t p = 0; p < found.size(); ++p) {
    // 2,400 photons and more a pulse: 2 ps; amplitudes to 2 %. Four deviations.
    const double off = std::remainder(found[p].time_ps - segment.pulse_times_ps[p], 1e6);
    EXPECT_NEAR(off, 0, 10) << p;
    EXPECT_NEAR(found[p].amplitude, segment.amplitudes[p], 0.1) << p;
  }
}

TEST(PulseFinder, APulseOverThePeriodsEndIsOnePulse) {
  test::FrameMaker made;
  made.pattern = test::periodic_pattern(100000);
  made.distance_m = 0;  // the pulse lies half before and half after the pattern start
  made.signal_per_pulse = 0.02;
  made.length_ms = 5;
  const auto found = fold(made, 1).find();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(std::remainder(found[0].time_ps, 100000), 0, 15);
  EXPECT_DOUBLE_EQ(found[0].amplitude, 1);
}

TEST(PulseFinder, BackgroundHasNoPulses) {
  test::FrameMaker made;
  made.pattern = test::periodic_pattern(3780000);
  made.signal_per_pulse = 0;
  EXPECT_TRUE(fold(made, 10).find().empty());
  EXPECT_TRUE(PulseFinder(3780000, 100).find().empty());
}

TEST(PulseFinder, FoldsOnTheMeasuredPeriod) {
  test::FrameMaker made;
  made.pattern = test::periodic_pattern(100000);
  made.drift_ppm = 50;
  made.distance_m = 3;
  made.signal_per_pulse = 0.02;
  made.length_ms = 5;
  const PulseFinder finder = fold(made, 2);
  EXPECT_NEAR(finder.mean_period_ps(), 100005, 1e-6);
  ASSERT_EQ(finder.find().size(), 1U);
  EXPECT_NEAR(finder.find()[0].time_ps, 6 / 0.299792458 * 1e3, 15);
}

TEST(PulseFinder, PassesOverFramesWithoutSync) {
  test::FrameMaker made;
  made.pattern = test::periodic_pattern(100000);
  made.length_ms = 1;
  auto frame = made.make(1);
  frame.sync.locked = false;
  PulseFinder finder(100000, 100);
  finder.add(frame.view());
  EXPECT_EQ(finder.photons(), 0U);
  EXPECT_EQ(finder.mean_period_ps(), 0);
}

}  // namespace
}  // namespace splid
