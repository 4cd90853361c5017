#include "estimator/calibration/calibration.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include "estimator/calibration/shape_stack.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid::calibration {
namespace {

struct Tail {
  double fraction = 0;
  double mean_ps = 0;
};

// Frames whose photons come late by a tail; background does not mind.
std::unique_ptr<PhaseHistogram> fold_of(const test::FrameMaker& made, int frames,
                                        std::uint64_t seed, const Tail& tail = {},
                                        double width_ps = 100) {
  auto fold = std::make_unique<PhaseHistogram>(made.pattern.segments.front().period_ps, width_ps);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int n = 0; n < frames; ++n) {
    auto frame = made.make(1000 * seed + static_cast<std::uint64_t>(n));
    for (std::int64_t& time_ps : frame.photons_ps) {
      if (uniform(random) >= tail.fraction) continue;
      time_ps += std::llround(-tail.mean_ps * std::log(1 - uniform(random)));
    }
    fold->add(frame.view());
  }
  return fold;
}

test::FrameMaker uneven(double signal_per_pulse) {
  test::FrameMaker made;
  made.pattern = test::random_pattern(300000, 12, 9000, 4);
  made.length_ms = 15;
  auto& segment = made.pattern.segments.front();
  for (std::size_t p = 0; p < segment.amplitudes.size(); ++p) {
    segment.amplitudes[p] = p % 2 == 0 ? 1.4 : 0.6;
  }
  made.distance_m = 0;
  made.signal_per_pulse = signal_per_pulse;
  return made;
}

// The point and the peak of a gaussian of 100 ps with a tail, from their formulas.
double density(double x_ps, const Tail& tail) {
  const double x = x_ps / 100;
  const double gaussian = std::exp(-0.5 * x * x) / std::sqrt(2 * M_PI) / 100;
  if (tail.fraction == 0) return gaussian;
  const double t = tail.mean_ps / 100;
  const double late = std::exp(0.5 / (t * t) - x / t) * std::erfc((1 / t - x) / std::sqrt(2.0)) /
                      (2 * tail.mean_ps);
  return (1 - tail.fraction) * gaussian + tail.fraction * late;
}

double point_ps(const Tail& tail) {
  double sum = 0, moment = 0;
  for (double x = -800; x < 6000; ++x) {
    const double square = density(x, tail) * density(x, tail);
    sum += square;
    moment += square * x;
  }
  return moment / sum;
}

struct Errors {
  double times = 0;       // rms of error over deviation
  double amplitudes = 0;  // rms of error over deviation
  double largest_ps = 0;
  double largest_part = 0;
};

Errors errors_over(const test::FrameMaker& made, int frames, int seeds, const Tail& tail) {
  const PatternSegment& truth = made.pattern.segments.front();
  const double late_ps = point_ps(tail);
  Errors errors;
  for (int seed = 1; seed <= seeds; ++seed) {
    const auto found =
        calibrate(*fold_of(made, frames, static_cast<std::uint64_t>(seed), tail), 100);
    EXPECT_TRUE(found && found->settled && found->pulses.size() == truth.pulse_times_ps.size());
    if (!found || found->pulses.size() != truth.pulse_times_ps.size()) return errors;
    const double values = static_cast<double>(seeds) * static_cast<double>(found->pulses.size());
    for (std::size_t p = 0; p < found->pulses.size(); ++p) {
      const CalibratedPulse& pulse = found->pulses[p];
      const double off_ps = pulse.time_ps - truth.pulse_times_ps[p] - late_ps;
      const double off = pulse.amplitude - truth.amplitudes[p];
      errors.times += std::pow(off_ps / pulse.std_time_ps, 2) / values;
      errors.amplitudes += std::pow(off / pulse.std_amplitude, 2) / values;
      errors.largest_ps = std::max(errors.largest_ps, std::abs(off_ps));
      errors.largest_part = std::max(errors.largest_part, std::abs(off) / truth.amplitudes[p]);
    }
  }
  errors.times = std::sqrt(errors.times);
  errors.amplitudes = std::sqrt(errors.amplitudes);
  return errors;
}

TEST(Calibration, AMillionPhotonsGiveTimesToFivePicosecondsAndAmplitudesToTwoPercent) {
  for (const Tail tail : {Tail{}, Tail{0.4, 300}}) {
    const Errors errors = errors_over(uneven(0.4), 4, 1, tail);
    EXPECT_LT(errors.largest_ps, 2);  // 0.3 to 0.6 are expected
    EXPECT_LT(errors.largest_part, 0.02);
  }
}

// 120 values: their rms is known to 6.5 %, a little worse as a seed's share the shape's own error.
TEST(Calibration, DeviationsAreThoseOfTheErrors) {
  for (const Tail tail : {Tail{}, Tail{0.3, 200}}) {
    const Errors errors = errors_over(uneven(0.02), 1, 10, tail);
    EXPECT_NEAR(errors.times, 1, 0.22) << tail.fraction;
    EXPECT_NEAR(errors.amplitudes, 1, 0.2) << tail.fraction;
  }
}

// Nothing but the shape's own point is uncertain of a single pulse.
TEST(Calibration, ASinglePulse) {
  test::FrameMaker made;
  made.pattern = test::periodic_pattern(100000);
  made.distance_m = 0;
  made.length_ms = 5;
  made.signal_per_pulse = 0.2;
  double squares = 0;
  constexpr int seeds = 20;
  for (int seed = 1; seed <= seeds; ++seed) {
    const auto found = calibrate(*fold_of(made, 1, static_cast<std::uint64_t>(seed)), 100);
    ASSERT_TRUE(found);
    ASSERT_EQ(found->pulses.size(), 1U);
    const CalibratedPulse& pulse = found->pulses[0];
    EXPECT_DOUBLE_EQ(pulse.amplitude, 1);
    EXPECT_NEAR(pulse.std_amplitude, 0, 1e-6);
    // 1.24 sigma / sqrt(N)
    EXPECT_NEAR(pulse.std_time_ps, 124 / std::sqrt(found->signal_photons), 0.15);
    squares += std::pow(std::remainder(pulse.time_ps, 1e5) / pulse.std_time_ps, 2) / seeds;
  }
  EXPECT_NEAR(std::sqrt(squares), 1, 0.45);
}

TEST(Calibration, TheShapeIsTheOneThatWasPlayed) {
  const Tail tail{0.4, 300};
  const auto found = calibrate(*fold_of(uneven(0.4), 4, 3, tail), 100);
  ASSERT_TRUE(found);
  ASSERT_EQ(found->std_density.size(), found->shape.density.size());
  EXPECT_NEAR(std::accumulate(found->shape.density.begin(), found->shape.density.end(), 0.0) *
                  found->shape.step_ps,
              1, 1e-9);
  EXPECT_NEAR(found->signal_photons, 960'000, 4'000);
  const auto shape = make_tabulated(found->shape);
  const double late_ps = point_ps(tail);
  for (double x = -300; x < 1500; x += 25) {
    const double truth = density(x + late_ps, tail);
    const double value = std::exp(shape->log_h(x * 1e-3)) * 1e-3;
    // 1 % of the peak's noise and 10 % of a tail's; a step of a third of a width leaves 1 % more.
    EXPECT_NEAR(value, truth, 0.02 * truth + 3e-5) << x;
  }
  // Half of what a gaussian leaves lies beyond 300 ps; of 300 ps tails a 400th beyond 1800.
  EXPECT_GT(shape->last_ns(), 1.8);
  EXPECT_LT(shape->last_ns(), 6);
}

TEST(Calibration, APulseWidthToWithinAFactorOfTwoWillDo) {
  for (const double width_ps : {55.0, 190.0}) {
    const auto found = calibrate(*fold_of(uneven(0.1), 1, 2, {}, width_ps), width_ps);
    ASSERT_TRUE(found);
    ASSERT_EQ(found->pulses.size(), 12U);
    EXPECT_NEAR(found->width_ps, 100, 3);
    for (std::size_t p = 0; p < 12; ++p) {
      const double truth_ps = uneven(0.1).pattern.segments.front().pulse_times_ps[p];
      EXPECT_NEAR(found->pulses[p].time_ps, truth_ps, 4.5 * found->pulses[p].std_time_ps);
    }
  }
}

// A pulse on another's tail, eight widths behind it: both come out right.
TEST(Calibration, NeighboursTailsAreToldApart) {
  test::FrameMaker made = uneven(0.2);
  auto& times = made.pattern.segments.front().pulse_times_ps;
  times[1] = times[0] + 800;
  const Errors errors = errors_over(made, 2, 3, {0.3, 300});
  EXPECT_LT(errors.largest_ps, 4.5);
  EXPECT_NEAR(errors.times, 1, 0.4);
  EXPECT_NEAR(errors.amplitudes, 1, 0.4);
}

TEST(Calibration, SaysHowManyPhotonsItNeeds) {
  Calibration found;
  found.pulses = {{0, 10, 1, 0.01}, {100, 1, 1, 0.03}};
  EXPECT_DOUBLE_EQ(photons_wanted(found, {5, 0.02}), 4);
  EXPECT_DOUBLE_EQ(photons_wanted(found, {20, 0.02}), 2.25);
  EXPECT_DOUBLE_EQ(photons_wanted(found, {20, 0.06}), 0.25);
}

TEST(Calibration, NothingWhereNoPulseStandsOut) {
  EXPECT_FALSE(calibrate(*fold_of(uneven(0), 1, 1), 100));
  EXPECT_FALSE(calibrate(*fold_of(uneven(0.1), 0, 1), 100));
}

Calibration pulses_at(std::vector<double> times_ps, double shift_ps) {
  Calibration found;
  found.period_ps = 12'512.6;
  found.width_ps = 80;
  for (double& time_ps : times_ps) {
    time_ps += shift_ps;
    time_ps -= found.period_ps * std::floor(time_ps / found.period_ps);
  }
  std::sort(times_ps.begin(), times_ps.end());
  for (const double time_ps : times_ps) found.pulses.push_back({time_ps, 0.7, 1, 0.01});
  return found;
}

// As in a recording of a real tagger: 3,128 ps apart to 60 ps.
const std::vector<double> nearly_even_ns{1'412.6, 4'525.6, 7'688.5, 10'760.9};

TEST(InputShift, IsFoundWhateverItIs) {
  for (const double shift_ps : {-6'000.0, -2'053.0, -30.0, 0.0, 1'060.0, 3'128.0, 6'200.0}) {
    const auto found =
        shift_between(pulses_at(nearly_even_ns, 0), pulses_at(nearly_even_ns, shift_ps));
    ASSERT_TRUE(found) << shift_ps;
    EXPECT_NEAR(found->shift_ps, shift_ps, 1e-6);
    EXPECT_NEAR(found->std_ps, 0.7 * std::sqrt(2.0) / 2, 1e-9);
    EXPECT_LT(found->rms_ps, 1e-6);
  }
}

TEST(InputShift, OfAnEvenCombIsTheSmallest) {
  const std::vector<double> even{0, 3'128.15, 6'256.3, 9'384.45};
  const auto found = shift_between(pulses_at(even, 500), pulses_at(even, 500 + 3'128.15 + 7));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->shift_ps, 7, 1e-6);
}

TEST(InputShift, IsNoneOfOtherPulses) {
  EXPECT_FALSE(shift_between(pulses_at(nearly_even_ns, 0), pulses_at({0, 2'000, 5'000, 9'500}, 0)));
  EXPECT_FALSE(shift_between(pulses_at(nearly_even_ns, 0), pulses_at({0, 3'000}, 0)));
  EXPECT_FALSE(shift_between(pulses_at({}, 0), pulses_at({}, 0)));
}

double log_likelihood(FoldModel& model) {
  double sum = 0;
  const auto& rates = model.rates();
  for (std::size_t b = 0; b < rates.size(); ++b) {
    sum += model.fold().counts()[b] * std::log(rates[b]) - rates[b];
  }
  return sum;
}

// Numeric twins of the fit's derivatives: at the maximum the slope is zero, and the curvature is
// the information, in a pair of pulses of which one lies on the other's flank.
TEST(FoldFit, ClimbsToTheMaximumAndItsInformationIsTheCurvature) {
  test::FrameMaker made;
  made.pattern = test::random_pattern(100000, 2, 9000, 4);
  made.pattern.segments.front().pulse_times_ps = {500, 800};
  made.distance_m = 0;
  made.signal_per_pulse = 0.4;
  made.background_per_ns = 1e-2;
  made.length_ms = 20;
  const auto fold = fold_of(made, 1, 7);
  FoldModel model(*fold, {{480, 60000}, {830, 90000}}, 100);
  fit_fold(model);
  const Eigen::MatrixXd inverse = fold_covariance(model).inverse();
  const auto value = [&](Eigen::Index i) -> double& {
    if (i < 2) return model.counts[static_cast<std::size_t>(i)];
    if (i < 4) return model.times_ps[static_cast<std::size_t>(i - 2)];
    return model.background_per_ps;
  };
  const auto at = [&](Eigen::Index i, double by_i, Eigen::Index j, double by_j) {
    const double kept_i = value(i), kept_j = value(j);
    value(i) += by_i;
    value(j) += by_j;
    const double sum = log_likelihood(model);
    value(j) = kept_j;
    value(i) = kept_i;
    return sum;
  };
  for (Eigen::Index i = 0; i < 5; ++i) {
    const double step_i = 1 / std::sqrt(inverse(i, i));
    const double slope = (at(i, step_i, i, 0) - at(i, -step_i, i, 0)) / 2;
    EXPECT_NEAR(slope, 0, 0.02) << i;  // of one deviation
    for (Eigen::Index j = 0; j < 5; ++j) {
      const double step_j = 1 / std::sqrt(inverse(j, j));
      const double curvature = (at(i, step_i, j, step_j) - at(i, step_i, j, -step_j) -
                                at(i, -step_i, j, step_j) + at(i, -step_i, j, -step_j)) /
                               4;
      // The observed against the expected information: 160,000 photons.
      EXPECT_NEAR(-curvature, inverse(i, j) * step_i * step_j, 0.03) << i << " " << j;
    }
  }
}

}  // namespace
}  // namespace splid::calibration
