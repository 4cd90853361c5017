#include "estimator/calibration/pulse_finder.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/frame_maker.hpp"

namespace splid::calibration {
namespace {

std::vector<FoundPulse> pulses_of(const test::FrameMaker& made, int frames) {
  const double width_ps = made.sigma_ns * 1e3;
  PhaseHistogram fold(made.pattern.segments.front().period_ps, width_ps);
  for (int n = 0; n < frames; ++n) fold.add(made.make(static_cast<std::uint64_t>(n)).view());
  return find_pulses(fold, width_ps);
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
  const auto found = pulses_of(made, 4);
  ASSERT_EQ(found.size(), 12U);
  for (std::size_t p = 0; p < found.size(); ++p) {
    // 2,400 photons and more a pulse: 2 ps; counts to 2 %. Four deviations. Within two widths are
    // 95 % of a pulse.
    const double off = std::remainder(found[p].time_ps - segment.pulse_times_ps[p], 1e6);
    EXPECT_NEAR(off, 0, 10) << p;
    EXPECT_NEAR(found[p].counts / (0.954 * 4000 * segment.amplitudes[p]), 1, 0.1) << p;
  }
}

TEST(PulseFinder, APulseOverThePeriodsEndIsOnePulse) {
  test::FrameMaker made;
  made.pattern = test::periodic_pattern(100000);
  made.distance_m = 0;  // the pulse lies half before and half after the pattern start
  made.signal_per_pulse = 0.02;
  made.length_ms = 5;
  const auto found = pulses_of(made, 1);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(std::remainder(found[0].time_ps, 100000), 0, 15);
}

TEST(PulseFinder, BackgroundHasNoPulses) {
  test::FrameMaker made;
  made.pattern = test::periodic_pattern(3780000);
  made.signal_per_pulse = 0;
  EXPECT_TRUE(pulses_of(made, 10).empty());
  EXPECT_TRUE(pulses_of(made, 0).empty());
}

// Twelve pulses of this width, in a fold whose bins are those of another configured width.
std::optional<double> width_of(double sigma_ps, double configured_ps, double signal_per_pulse) {
  test::FrameMaker made;
  made.pattern = test::random_pattern(1'000'000, 12, 9000, 4);
  made.sigma_ns = sigma_ps * 1e-3;
  made.signal_per_pulse = signal_per_pulse;
  made.background_per_ns = 2e-4;
  PhaseHistogram fold(1'000'000, configured_ps);
  for (std::uint64_t n = 0; n < 10; ++n) {
    fold.add(made.make(n).view());
    made.start_ps += 50'000'000'000;
  }
  return width_by_pairs_ps(fold);
}

TEST(PairWidth, IsThatOfThePulsesWhateverWasConfigured) {
  for (const double sigma_ps : {20.0, 100.0, 700.0}) {
    for (const double configured_ps : {2.0, 100.0, 500.0}) {
      const auto found_ps = width_of(sigma_ps, configured_ps, 0.01);
      ASSERT_TRUE(found_ps) << sigma_ps << " " << configured_ps;
      EXPECT_GT(*found_ps, 0.65 * sigma_ps) << configured_ps;
      EXPECT_LT(*found_ps, 1.5 * sigma_ps) << configured_ps;
    }
  }
}

TEST(PairWidth, AbsentWherePhotonsShowNoPulses) {
  EXPECT_FALSE(width_of(100, 100, 0));
  EXPECT_FALSE(width_by_pairs_ps(PhaseHistogram(1'000'000, 100)));
}

}  // namespace
}  // namespace splid::calibration
