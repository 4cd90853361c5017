#include "estimator/checks/pulse_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"
#include "tests/support/sanitized.hpp"

namespace splid {
namespace {

constexpr double pulse_width_ns = 0.1;

// As many of so many pulses with 1 - spread of the mean light as with 1 + spread.
HidingLight hiding(double mean, double spread, double pulses) {
  if (!(mean > 0)) return {};
  return {{{{mean * (1 - spread), pulses / 2}, {mean * (1 + spread), pulses / 2}}}, 2};
}

// Light about a pulse: photons of a gaussian, of a second surface behind it, and of background.
struct PulseLight {
  int photons = 300;
  double sigma_ns = pulse_width_ns;
  double behind_ns = 0;
  double share_behind = 0;
  double background_per_ns = 30;
  double hidden = 0;  // mean light of a pulse, of which the detector sees the first photon
  double spread = 0;  // of the pulses' light: every other pulse has so much more, or less

  // What the check says of one draw.
  PulseVerdict drawn(PulseCheck& check, std::mt19937_64& random) const {
    std::normal_distribution<double> pulse(0, sigma_ns);
    std::uniform_real_distribution<double> unit(0, 1), window(check.first_ns(), check.last_ns());
    std::poisson_distribution<int> count(hidden > 0 ? hidden * (1 + spread) : photons);
    std::poisson_distribution<int> fewer(std::max(1e-9, hidden * (1 - spread)));
    std::poisson_distribution<int> dark(
        std::max(1e-9, background_per_ns * (check.last_ns() - check.first_ns())));
    check.clear();
    const auto add = [&](double t) {
      if (t > check.first_ns() && t < check.last_ns()) check.add(t);
    };
    const auto late = [&] { return unit(random) < share_behind ? behind_ns : 0; };
    if (hidden > 0) {
      for (int n = 0; n < photons; ++n) {
        double first = 1e9;
        for (int k = n % 2 == 0 ? count(random) : fewer(random); k > 0; --k) {
          first = std::min(first, pulse(random));
        }
        add(first);
      }
    } else {
      for (int n = count(random); n > 0; --n) add(pulse(random) + late());
    }
    if (background_per_ns > 0) {
      for (int n = dark(random); n > 0; --n) add(window(random));
    }
    return check.judge(background_per_ns * check.bin_ns(), hiding(hidden, spread, photons));
  }
};

int alarms(const PulseLight& light, int draws, const PulseShape& shape) {
  PulseCheck check(shape, 9);
  std::mt19937_64 random(5);
  int seen = 0;
  for (int n = 0; n < draws; ++n) seen += light.drawn(check, random).misfit ? 1 : 0;
  return seen;
}

// The mean width ratio over draws that all show a misfit.
double seen_ratio(const PulseLight& light) {
  const GaussianPulse shape(pulse_width_ns);
  PulseCheck check(shape, 9);
  std::mt19937_64 random(5);
  double sum = 0;
  constexpr int draws = 50;
  for (int n = 0; n < draws; ++n) {
    const auto misfit = light.drawn(check, random).misfit;
    EXPECT_TRUE(misfit);
    sum += misfit ? misfit->width_ratio : 0;
  }
  return sum / draws;
}

TEST(PulseCheck, SaysNothingOfTheConfiguredPulse) {
  const GaussianPulse shape(pulse_width_ns);
  for (const int photons : {45, 100, 300, 5000}) {
    for (const double background : {0.0, 30.0, 2000.0}) {
      PulseLight light;
      light.photons = photons;
      light.background_per_ns = background;
      EXPECT_EQ(alarms(light, test::times(1500), shape), 0) << photons << ", " << background;
    }
  }
}

TEST(PulseCheck, SaysByHowMuchThePulseIsWiderOrNarrower) {
  PulseLight light;
  for (const double ratio : {0.6, 1.5, 2.0, 3.0}) {
    light.sigma_ns = ratio * pulse_width_ns;
    EXPECT_NEAR(seen_ratio(light), ratio, 0.05 * ratio) << ratio;
  }
}

// A third of the light comes from two widths behind: the deviation of all of it is 1.37 widths.
TEST(PulseCheck, NoticesASecondSurfaceCloseBehind) {
  PulseLight light;
  light.photons = 700;
  light.share_behind = 1.0 / 3;
  light.behind_ns = 0.2;
  EXPECT_NEAR(seen_ratio(light), 1.37, 0.08);
  for (const double behind_widths : {3.0, 4.0}) {
    light.behind_ns = behind_widths * pulse_width_ns;
    EXPECT_GT(seen_ratio(light), 1.5) << behind_widths;
  }
}

TEST(PulseCheck, SaysNothingOfTooFewPhotons) {
  PulseLight light;
  light.photons = 12;
  light.sigma_ns = 0.3;
  EXPECT_EQ(alarms(light, 300, GaussianPulse(pulse_width_ns)), 0);
}

// The mean excess over draws, and its deviation by what the draws say of themselves.
PulseVerdict mean_excess(const PulseLight& light, int draws) {
  const GaussianPulse shape(pulse_width_ns);
  PulseCheck check(shape, 9);
  std::mt19937_64 random(11);
  double weights = 0, sum = 0;
  for (int n = 0; n < draws; ++n) {
    const PulseVerdict verdict = light.drawn(check, random);
    if (verdict.std_excess == 0) continue;  // too few photons beside the background
    const double weight = 1 / (verdict.std_excess * verdict.std_excess);
    weights += weight;
    sum += weight * verdict.excess;
  }
  return {sum / weights, 1 / std::sqrt(weights), {}};
}

// The mean of 4000 draws is known to 0.2 % of the width and better. Photons that also tell the
// pulse's place appear narrower by a share of one over their number.
TEST(PulseCheck, SaysOnAverageThatTheConfiguredPulseIsRight) {
  for (const int photons : {100, 300, 1200}) {
    for (const double background : {0.0, 30.0, 300.0}) {
      PulseLight light;
      light.photons = photons;
      light.background_per_ns = background;
      const int draws = test::times(4000);
      const PulseVerdict mean = mean_excess(light, draws);
      EXPECT_LT(mean.std_excess, 0.004 * std::sqrt(4000.0 / draws));
      EXPECT_NEAR(mean.excess, 0, 3.5 * mean.std_excess + 1.5 / photons)
          << photons << ", " << background;
    }
  }
}

TEST(PulseCheck, SaysOnAverageWhatNoSingleFrameShows) {
  PulseLight light;
  light.photons = 1200;
  for (const double ratio : {0.95, 1.03, 1.06}) {
    light.sigma_ns = ratio * pulse_width_ns;
    EXPECT_LE(alarms(light, 100, GaussianPulse(pulse_width_ns)), 5) << ratio;
    const PulseVerdict mean = mean_excess(light, 1000);
    EXPECT_LT(mean.std_excess, 0.002);
    EXPECT_NEAR(1 + mean.excess, ratio, 0.006) << ratio;
  }
}

// The first photon of a bright pulse comes early, and all first photons lie closer together.
TEST(PulseCheck, KnowsThatADeadTimeHidesAPulsesLaterPhotons) {
  PulseLight light;
  light.photons = 5000;
  light.hidden = 3;
  light.background_per_ns = 0;
  const GaussianPulse shape(pulse_width_ns);
  EXPECT_EQ(alarms(light, 50, shape), 0);
  PulseCheck check(shape, 9);
  std::mt19937_64 random(5);
  ASSERT_FALSE(light.drawn(check, random).misfit);
  EXPECT_TRUE(check.judge(0, {}).misfit);
}

// Taken for alike they would be 4 % wider.
TEST(PulseCheck, KnowsThatBrightPulsesHideMoreThanOthers) {
  PulseLight light;
  light.photons = 20000;
  light.hidden = 3;
  light.spread = 0.5;
  light.background_per_ns = 0;
  const GaussianPulse shape(pulse_width_ns);
  EXPECT_EQ(alarms(light, 20, shape), 0);
  const PulseVerdict mean = mean_excess(light, 20);
  EXPECT_NEAR(mean.excess, 0, 4 * mean.std_excess);
  PulseCheck check(shape, 9);
  std::mt19937_64 random(5);
  light.drawn(check, random);
  EXPECT_TRUE(check.judge(0, hiding(light.hidden, 0, light.photons)).misfit);
}

TEST(PulseCheck, KnowsATabulatedPulse) {
  TabulatedPulse table;
  table.first_ps = -600;
  table.step_ps = 25;
  for (int n = 0; n < 49; ++n) {
    const double x = (n * 25 - 600) / 100.0;
    table.density.push_back(std::exp(-x * x / 2));
  }
  const auto shape = make_tabulated(table);
  EXPECT_EQ(alarms({}, 300, *shape), 0);
  PulseLight wide;
  wide.sigma_ns = 0.17;
  EXPECT_EQ(alarms(wide, 30, *shape), 30);
}

TEST(PulseCheck, LeavesPulsesThatOverlapAlone) {
  EXPECT_FALSE(PulseCheck(GaussianPulse(pulse_width_ns), 0.7).looks());
  EXPECT_TRUE(PulseCheck(GaussianPulse(pulse_width_ns), 0.9).looks());
}

test::FrameMaker one_surface() {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.velocity_mps = 30;
  return made;
}

double distance_error_m(const Estimate& e, const test::FrameMaker& made) {
  return e.delay_ns * 0.299792458 / 2 - made.distance_m;
}

TEST(PulseMisfit, IsAbsentWhereThePulseIsTheConfiguredOne) {
  const test::FrameMaker made = one_surface();
  FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, 100'000);
  for (std::uint64_t n = 0; n < 30; ++n) {
    EXPECT_EQ(estimator.estimate(made.make(n).view()).pulse_misfit, std::nullopt);
  }
}

// A second surface half as bright, 3 cm behind, moves the distance by many of the deviations that
// a frame with one surface has. The frame says so, and its deviation holds the error.
TEST(PulseMisfit, NoticesASecondSurfaceAndSaysHowUncertainTheDistanceIs) {
  const test::FrameMaker made = one_surface();
  test::FrameMaker behind = made;
  behind.distance_m += 0.03;
  behind.signal_per_pulse /= 2;
  FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, 100'000);
  for (std::uint64_t n = 0; n < 20; ++n) {
    const Estimate e = estimator.estimate(made.make_with({behind}, n).view());
    EXPECT_EQ(e.status, FrameStatus::ok);
    ASSERT_TRUE(e.pulse_misfit);
    const double std_m = e.std_delay_ns * 0.299792458 / 2;
    EXPECT_GT(distance_error_m(e, made), 0.005);
    EXPECT_LT(std::abs(distance_error_m(e, made)), std_m);
    EXPECT_LT(std_m, 0.03);
    const double total_signal = made.signal_per_pulse * 1.5;
    EXPECT_LT(std::abs(e.signal_per_pulse - total_signal), 4 * e.std_signal_per_pulse);
  }
}

// A second surface half as bright 1 cm behind moves the distance by 3.3 mm, five of its deviations,
// and no frame shows it. The mean of 100 frames does.
TEST(PulseMisfit, IsSeenOverManyFramesWhereNoSingleFrameShowsIt) {
  const test::FrameMaker made = one_surface();
  test::FrameMaker behind = made;
  behind.distance_m += 0.01;
  behind.signal_per_pulse /= 2;
  FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, 100'000);
  double weights[2] = {}, sums[2] = {};
  int misfits = 0;
  for (std::uint64_t n = 0; n < 100; ++n) {
    for (const int surfaces : {1, 2}) {
      const auto frame = surfaces == 1 ? made.make(n) : made.make_with({behind}, n);
      const Estimate e = estimator.estimate(frame.view());
      ASSERT_GT(e.std_pulse_excess, 0);
      const double weight = 1 / (e.std_pulse_excess * e.std_pulse_excess);
      weights[surfaces - 1] += weight;
      sums[surfaces - 1] += weight * e.pulse_excess;
      misfits += e.pulse_misfit ? 1 : 0;
    }
  }
  EXPECT_LE(misfits, 2);
  EXPECT_LT(std::abs(sums[0] / weights[0]), 4 / std::sqrt(weights[0]));
  EXPECT_GT(sums[1] / weights[1], 0.03);
  EXPECT_GT(sums[1] / weights[1], 6 / std::sqrt(weights[1]));
}

TEST(PulseMisfit, HoldsForATargetOnABentPathTakenAsStraight) {
  test::FrameMaker made = one_surface();
  made.acceleration_mps2 = 100;  // bends the delay by 8 widths
  made.signal_per_pulse *= 8;
  FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, 100'000);
  EXPECT_TRUE(estimator.estimate(made.make(3).view()).pulse_misfit);
}

FrameEstimator knows_dead_time(const test::FrameMaker& made) {
  return {made.pattern,       {}, {}, {}, made.length_ms, 1'000'000, ClockReference::tagger,
          {made.dead_time_ns}};
}

// A detector that is blind for 50 ns sees at most one photon of a pulse.
TEST(PulseMisfit, IsAbsentWhereTheDeadTimeIsModelled) {
  test::FrameMaker made = one_surface();
  made.length_ms = 5;
  made.signal_per_pulse = 0.5;
  made.dead_time_ns = 50;
  FrameEstimator estimator = knows_dead_time(made);
  for (std::uint64_t n = 0; n < 5; ++n) {
    const Estimate e = estimator.estimate(made.make(n).view());
    EXPECT_TRUE(e.dead_time_modelled);
    EXPECT_EQ(e.pulse_misfit, std::nullopt);
  }
}

// Taken for alike, or for two kinds of the same mean and spread, some of which come while the
// detector is blind, these pulses would be some per cent wider or narrower than configured.
TEST(PulseMisfit, IsAbsentWhereBrightPulsesDiffer) {
  for (const double dimmer : {0.1, 0.5}) {
    test::FrameMaker made = one_surface();
    double amplitude = dimmer;
    for (double& a : made.pattern.segments[0].amplitudes) {
      a = std::exchange(amplitude, 2 - amplitude);
    }
    made.length_ms = 20;
    made.signal_per_pulse = 3;
    made.dead_time_ns = 50;
    FrameEstimator estimator = knows_dead_time(made);
    for (std::uint64_t n = 0; n < 3; ++n) {
      const Estimate e = estimator.estimate(made.make(n).view());
      ASSERT_TRUE(e.dead_time_modelled);
      EXPECT_EQ(e.pulse_misfit, std::nullopt) << dimmer;
      EXPECT_LT(std::abs(e.signal_per_pulse - 3), 4 * e.std_signal_per_pulse) << dimmer;
      EXPECT_LT(std::abs(e.pulse_excess), 4 * e.std_pulse_excess) << dimmer;
    }
  }
}

// The mean of the excess over frames of a detector that is blind for 50 ns, in deviations of that
// mean. None of these frames has a misfit.
double mean_excess_deviations(test::FrameMaker made, int frames) {
  made.dead_time_ns = 50;
  FrameEstimator estimator = knows_dead_time(made);
  double excess = 0, information = 0;
  for (int n = 0; n < frames; ++n) {
    const Estimate e = estimator.estimate(made.make(static_cast<std::uint64_t>(n)).view());
    EXPECT_TRUE(e.dead_time_modelled);
    EXPECT_EQ(e.pulse_misfit, std::nullopt);
    const double weight = 1 / (e.std_pulse_excess * e.std_pulse_excess);
    excess += weight * e.pulse_excess;
    information += weight;
  }
  return excess / std::sqrt(information);
}

// Dead times that end within a pulse, and background just before it, would make it 1 % wider.
TEST(PulseMisfit, IsAbsentWhereTheDetectorIsBlindForMostOfTheTime) {
  test::FrameMaker made = one_surface();
  made.signal_per_pulse = 3;
  made.background_per_ns = 3.0 / 50;
  EXPECT_LT(std::abs(mean_excess_deviations(made, 6)), 3.5);
}

// All pulses of a rate come at the same phase, and so do the edges of the bins about them. Photons
// in the middle of their bin of phase would make the pulse 0.4 % wider.
TEST(PulseMisfit, IsAbsentWhereAllPulsesHaveOnePhase) {
  test::FrameMaker made = one_surface();
  made.pattern = test::mrr_pattern({180000, 189000}, 3780000, 37800000);
  made.signal_per_pulse = 1;
  made.background_per_ns = 2e-3;
  EXPECT_LT(std::abs(mean_excess_deviations(made, 8)), 3.5);
}

// The first photons of a wide pulse come early: 1 % of its width is 7 deviations of the distance,
// and 3 of the signal.
TEST(PulseMisfit, HoldsTheValuesWhereTheFirstPhotonHidesTheRest) {
  for (const double wider : {0.99, 1.0, 1.01}) {
    test::FrameMaker made = one_surface();
    made.sigma_ns *= wider;
    made.signal_per_pulse = 3;
    made.dead_time_ns = 50;
    FrameEstimator estimator = knows_dead_time(made);
    const Estimate e = estimator.estimate(made.make(4).view());
    ASSERT_TRUE(e.dead_time_modelled);
    EXPECT_EQ(e.pulse_misfit.has_value(), wider != 1.0) << wider;
    EXPECT_NEAR(e.pulse_misfit.value_or(0), wider - 1, 0.005);
    const double off_ns = e.delay_ns - 2 * made.distance_m / 0.299792458;
    EXPECT_LT(std::abs(std::remainder(off_ns, 3780.0)), 3 * e.std_delay_ns) << wider;
    EXPECT_LT(std::abs(e.signal_per_pulse - 3), 3 * e.std_signal_per_pulse) << wider;
  }
}

}  // namespace
}  // namespace splid
