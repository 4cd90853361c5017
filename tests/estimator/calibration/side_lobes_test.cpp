#include "estimator/calibration/side_lobes.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "estimator/frame_estimator.hpp"
#include "protocol/pattern_make.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid::calibration {
namespace {

constexpr double sigma_ps = 100;
const auto shape = make_gaussian(sigma_ps * 1e-3);

// Eight pulses, each so far from even.
Pattern nearly_even(double period_ps, const std::array<double, 8>& off_ps) {
  Pattern pattern = make_periodic(Mode::baseline, period_ps, 8);
  for (std::size_t p = 0; p < off_ps.size(); ++p) {
    pattern.segments.front().pulse_times_ps[p] += off_ps[p] + 10;
  }
  pattern.mode = Mode::random;
  pattern.unambiguous_delay_ps = period_ps;
  return pattern;
}

TEST(SideLobe, CopiesOfAnEvenCombAreNeverTold) {
  const Pattern comb = nearly_even(100'000, {});
  const auto delays = side_lobes(comb, *shape);
  ASSERT_EQ(delays.size(), 7u);
  for (const SideLobe& delay : delays) EXPECT_GT(photons_to_tell(delay), 1e9);
  const auto spacing_ps = even_spacing_ps(delays, 100'000, 1e6, sigma_ps);
  ASSERT_TRUE(spacing_ps);
  EXPECT_EQ(*spacing_ps, 12'500);
}

// The pulses' deviations from those they fall on, in sigma, squared, times N / 2.
TEST(SideLobe, OfANearlyEvenCombIsWhatItsDeviationsSay) {
  const std::array<double, 8> off_ps{12, -7, 3, -15, 9, -2, -11, 11};
  const Pattern comb = nearly_even(100'000, off_ps);
  const auto delays = side_lobes(comb, *shape, {1e-6});
  ASSERT_EQ(delays.size(), 7u);
  for (const SideLobe& delay : delays) {
    const auto lag = static_cast<std::size_t>(std::round(delay.shift_ps / 12'500));
    double mean = 0, squares = 0;
    for (std::size_t p = 0; p < 8; ++p) {
      const double off = off_ps[(p + lag) % 8] - off_ps[p];
      mean += off / 8;
      squares += off * off / 8;
    }
    const double expected = (squares - mean * mean) / (2 * sigma_ps * sigma_ps);
    EXPECT_NEAR(delay.nats_per_photon, expected, 0.02 * expected) << lag;
  }
  // Told with light, not without.
  const double needed = photons_to_tell(delays.front());
  EXPECT_FALSE(even_spacing_ps(delays, 100'000, 1.01 * needed, sigma_ps));
  EXPECT_TRUE(even_spacing_ps(delays, 100'000, 0.5 * needed, sigma_ps));
}

// Even at every second pulse: the light tells odd ones apart, and no light the even ones.
TEST(SideLobe, OfPairsIsThePairsSpacing) {
  const Pattern pairs = nearly_even(100'000, {0, 900, 1, 901, -1, 899, 0, 900});
  const auto delays = side_lobes(pairs, *shape);
  const auto spacing_ps = even_spacing_ps(delays, 100'000, 20'000, sigma_ps);
  ASSERT_TRUE(spacing_ps);
  EXPECT_EQ(*spacing_ps, 25'000);
}

TEST(SideLobe, TheCalibrationsOwnDeviationsTellNothing) {
  Pattern comb = nearly_even(100'000, {3, -2, 2, -3, 3, -1, -3, 1});
  const double sure = side_lobes(comb, *shape).front().nats_per_photon;
  comb.calibration.emplace();
  comb.calibration->std_pulse_times_ps.assign(8, 3);
  EXPECT_GT(sure, 1e-4);
  EXPECT_LT(side_lobes(comb, *shape).front().nats_per_photon, 0.1 * sure);
}

TEST(SideLobe, PatternsOfTheFieldTakeSomeTensOfPhotons) {
  for (const Pattern& pattern :
       {make_interleaved(std::array{180e3, 189e3}), make_random({3'780'000, 40, 9'000, 1}),
        make_mrr(std::array{180e3, 189e3}, std::array<std::int64_t, 2>{2778, 2646})}) {
    const auto delays = side_lobes(pattern, *shape);
    ASSERT_FALSE(delays.empty());
    EXPECT_GT(photons_to_tell(delays.front()), 5) << to_string(pattern.mode);
    EXPECT_LT(photons_to_tell(delays.front()), 60) << to_string(pattern.mode);
  }
  EXPECT_TRUE(side_lobes(make_periodic(Mode::baseline, 1e6, 1), *shape).empty());
}

// 99.9 and 104.1 ns: 124 periods of one are 119 of the other less 0.3 ns.
TEST(SideLobe, OfRatesInTurnIsWhereTheirPeriodsMeet) {
  Pattern pattern = make_mrr(std::array{99.9e3, 104.1e3}, std::array<std::int64_t, 2>{100, 100});
  const auto delays = side_lobes(pattern, *shape);
  ASSERT_FALSE(delays.empty());
  EXPECT_NEAR(delays.front().shift_ps, 124 * 99.9e3, 400);
}

// What is said of the light is what frames do: with half of the photons it takes some are wrong,
// with twice as many none of 300.
TEST(SideLobe, FramesAreWrongAsOftenAsItSays) {
  test::FrameMaker made;
  made.pattern = nearly_even(100'000, {20, -12, 5, -25, 15, -3, -18, 18});
  made.length_ms = 1;
  made.background_per_ns = 1e-6;
  made.distance_m = 3;
  const double needed = photons_to_tell(side_lobes(made.pattern, *shape).front());
  SceneOptions scene;
  scene.motion = Motion::static_target;
  int wrong[2] = {0, 0};
  for (int more = 0; more < 2; ++more) {
    const double photons = needed * (more == 0 ? 0.1 : 1.5);
    made.signal_per_pulse = photons / 8 / (made.length_ms * 1e9 / 100'000);
    FrameEstimator estimator(made.pattern, {}, scene, {}, made.length_ms, 100'000);
    for (std::uint64_t n = 0; n < 300; ++n) {
      const Estimate e = estimator.estimate(made.make(n).view());
      const double off_ns = std::remainder(e.delay_ns - 2 * made.distance_m / 0.299792458, 100);
      wrong[more] += e.has_values && std::abs(off_ns) > 1 ? 1 : 0;
    }
  }
  EXPECT_GT(wrong[0], 20);
  EXPECT_LE(wrong[1], 1);
}

}  // namespace
}  // namespace splid::calibration
