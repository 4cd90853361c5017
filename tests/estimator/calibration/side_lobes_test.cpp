#include "estimator/calibration/side_lobes.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "estimator/frame_estimator.hpp"
#include "protocol/pattern_make.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid::calibration {
namespace {

constexpr double sigma_ps = 100;
const auto shape = make_gaussian(sigma_ps * 1e-3);
using Offsets = std::array<double, 8>;  // of eight pulses from even spacing, ps

// A calibration from so many signal photons in a second, without background.
Calibration calibrated(const Offsets& off_ps, double photons) {
  Calibration found;
  found.period_ps = 100'000;
  found.seconds = 1;
  for (std::size_t p = 0; p < off_ps.size(); ++p) {
    const double of_pulse = photons / 8;
    found.pulses.push_back({10 + 12'500 * static_cast<double>(p) + off_ps[p],
                            sigma_ps / std::sqrt(of_pulse), 1, 1 / std::sqrt(of_pulse)});
  }
  return found;
}

TEST(RangesAlike, AnEvenCombIsKnownModuloItsSpacing) {
  EXPECT_EQ(ranges_alike(calibrated({}, 1e6), 1), 8U);
  EXPECT_EQ(ranges_alike(calibrated({}, 1e12), 1), 8U);
}

// Even at every second pulse: the light tells odd ones apart, and no light the even ones.
TEST(RangesAlike, OfPairsIsThePairsSpacing) {
  EXPECT_EQ(ranges_alike(calibrated({0, 900, 0, 900, 0, 900, 0, 900}, 1e6), 0.02), 4U);
}

TEST(RangesAlike, ASinglePulseAndUnevenPulsesHaveOneRange) {
  Calibration one = calibrated({}, 1e6);
  one.pulses.resize(1);
  EXPECT_EQ(ranges_alike(one, 1), 1U);
  EXPECT_EQ(ranges_alike(calibrated({0, 900, -3000, 200, 5000, 10, 20, 4000}, 1e4), 1), 1U);
  Calibration bright = calibrated({}, 1e6);
  bright.pulses.front().amplitude = 1.1;
  EXPECT_EQ(ranges_alike(bright, 1), 1U);
}

// Pulses that differ by chance alone: by the deviations of the calibration.
TEST(RangesAlike, TheCalibrationsOwnDeviationsTellNothing) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 1);
  for (int trial = 0; trial < 100; ++trial) {
    Calibration comb = calibrated({}, 1e6);
    for (CalibratedPulse& pulse : comb.pulses) {
      pulse.time_ps += pulse.std_time_ps * noise(random);
      pulse.amplitude += pulse.std_amplitude * noise(random);
    }
    EXPECT_EQ(ranges_alike(comb, 0.05), 8U);
  }
}

Pattern nearly_even(const Offsets& off_ps) {
  Pattern pattern = test::periodic_pattern(100'000);
  PatternSegment& segment = pattern.segments.front();
  segment = {100'000, {}, std::vector<double>(8, 1.0), 0};
  for (const CalibratedPulse& pulse : calibrated(off_ps, 1).pulses) {
    segment.pulse_times_ps.push_back(pulse.time_ps);
  }
  pattern.mode = Mode::random;
  return pattern;
}

// The pulses' deviations from those they fall on, in sigma, squared, over 2.
TEST(SideLobe, OfANearlyEvenCombIsWhatItsDeviationsSay) {
  const Offsets off_ps = {12, -7, 3, -15, 9, -2, -11, 11};
  double least = 1;
  for (std::size_t lag = 1; lag < 8; ++lag) {
    double squares = 0;
    for (std::size_t p = 0; p < 8; ++p) {
      squares += std::pow(off_ps[(p + lag) % 8] - off_ps[p], 2) / 8;
    }
    least = std::min(least, squares / (2 * sigma_ps * sigma_ps));
  }
  const auto hardest = hardest_delay(nearly_even(off_ps), *shape);
  ASSERT_TRUE(hardest);
  EXPECT_NEAR(hardest->nats_per_photon, least, 1e-6);
  EXPECT_NEAR(std::remainder(hardest->shift_ps, 12'500), 0, 20);
  EXPECT_GT(hardest_delay(nearly_even({}), *shape)->photons_to_tell(), 1e9);
}

TEST(SideLobe, TheCalibrationsOwnDeviationsTellNothing) {
  Pattern comb = nearly_even({3, -2, 2, -3, 3, -1, -3, 1});
  const double sure = hardest_delay(comb, *shape)->nats_per_photon;
  comb.calibration.emplace();
  comb.calibration->std_pulse_times_ps.assign(8, 3);
  EXPECT_GT(sure, 1e-4);
  EXPECT_LT(hardest_delay(comb, *shape)->nats_per_photon, 0.1 * sure);
}

TEST(SideLobe, PatternsOfTheFieldTakeSomeTensOfPhotons) {
  for (const Pattern& pattern :
       {make_interleaved(std::array{180e3, 189e3}), make_random({3'780'000, 40, 9'000, 1}),
        make_mrr(std::array{180e3, 189e3}, std::array<std::int64_t, 2>{2778, 2646})}) {
    const auto hardest = hardest_delay(pattern, *shape);
    ASSERT_TRUE(hardest);
    EXPECT_GT(hardest->photons_to_tell(), 5) << to_string(pattern.mode);
    EXPECT_LT(hardest->photons_to_tell(), 60) << to_string(pattern.mode);
  }
  EXPECT_FALSE(hardest_delay(make_periodic(Mode::baseline, 1e6, 1), *shape));
}

// 99.9 and 104.1 ns: 124 periods of one are 119 of the other less 0.3 ns.
TEST(SideLobe, OfRatesInTurnIsWhereTheirPeriodsMeet) {
  const auto hardest = hardest_delay(
      make_mrr(std::array{99.9e3, 104.1e3}, std::array<std::int64_t, 2>{100, 100}), *shape);
  ASSERT_TRUE(hardest);
  EXPECT_NEAR(hardest->shift_ps, 124 * 99.9e3, 400);
}

// With the light that just tells the ranges apart frames are right, with a tenth of it they are
// wrong often.
TEST(SideLobe, FramesAreWrongAsOftenAsItSays) {
  const Offsets off_ps = {20, -12, 5, -25, 15, -3, -18, 18};
  test::FrameMaker made;
  made.pattern = nearly_even(off_ps);
  made.length_ms = 1;
  made.background_per_ns = 1e-6;
  made.distance_m = 3;
  const double needed = hardest_delay(made.pattern, *shape)->photons_to_tell();
  const Calibration exact = calibrated(off_ps, 1e12);
  EXPECT_GT(ranges_alike(exact, 0.2 * needed / 1e12), 1U);
  EXPECT_EQ(ranges_alike(exact, 5 * needed / 1e12), 1U);
  SceneOptions scene;
  scene.motion = Motion::static_target;
  for (const double share : {0.1, 1.0}) {
    made.signal_per_pulse = share * needed / 8 / (made.length_ms * 1e9 / 100'000);
    FrameEstimator estimator(made.pattern, {}, scene, {}, made.length_ms, 100'000);
    int wrong = 0;
    for (std::uint64_t n = 0; n < 300; ++n) {
      const Estimate e = estimator.estimate(made.make(n).view());
      const double off_ns = std::remainder(e.delay_ns - 2 * made.distance_m / 0.299792458, 100);
      wrong += e.has_values && std::abs(off_ns) > 1 ? 1 : 0;
    }
    EXPECT_TRUE(share < 1 ? wrong > 20 : wrong <= 1) << share << " " << wrong;
  }
}

}  // namespace
}  // namespace splid::calibration
