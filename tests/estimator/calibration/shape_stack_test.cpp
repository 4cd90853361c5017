#include "estimator/calibration/shape_stack.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include "estimator/calibration/fold_model.hpp"
#include "estimator/calibration/phase_histogram.hpp"

namespace splid::calibration {
namespace {

// A gaussian of 100 ps, of which a part of the photons comes late by an exponential of mean_ps.
struct Truth {
  double late_part = 0;
  double mean_ps = 1;

  [[nodiscard]] double density(double x_ps) const {
    const double x = x_ps / 100;
    const double t = mean_ps / 100;
    const double prompt = std::exp(-0.5 * x * x) / std::sqrt(2 * M_PI) / 100;
    const double late =
        std::exp(0.5 / (t * t) - x / t) * std::erfc((1 / t - x) / std::sqrt(2.0)) / (2 * mean_ps);
    return late_part == 0 ? prompt : (1 - late_part) * prompt + late_part * late;
  }
  double draw_ps(std::mt19937_64& random) const {
    std::uniform_real_distribution<double> uniform(0, 1);
    double x_ps = std::normal_distribution<double>(0, 100)(random);
    if (uniform(random) < late_part) x_ps -= mean_ps * std::log(1 - uniform(random));
    return x_ps;
  }
};

constexpr std::int64_t period_ps = 100'000;

struct Pulse {
  double time_ps;
  int photons;
};

// Photons of pulses at known times in a period of 100 ns, folded; background_photons lie anywhere.
std::unique_ptr<PhaseHistogram> folded(const Truth& truth, const std::vector<Pulse>& pulses,
                                       int background_photons, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<std::int64_t> photons_ps;
  // Each photon in a period of its own, around the frame's middle, so that none falls outside.
  std::uniform_int_distribution<std::int64_t> turn(10, 990);
  for (const Pulse& pulse : pulses) {
    for (int n = 0; n < pulse.photons; ++n) {
      photons_ps.push_back(turn(random) * period_ps +
                           std::llround(pulse.time_ps + truth.draw_ps(random)));
    }
  }
  std::uniform_int_distribution<std::int64_t> anywhere(0, 1000 * period_ps - 1);
  for (int n = 0; n < background_photons; ++n) photons_ps.push_back(anywhere(random));
  FrameView view{0, 1000 * period_ps, photons_ps, {}, {}};
  view.sync.locked = true;
  view.sync.period_ps = period_ps;
  auto fold = std::make_unique<PhaseHistogram>(period_ps, 100);
  fold->add(view);
  return fold;
}

FoldModel model_of(const PhaseHistogram& fold, const std::vector<Pulse>& pulses,
                   int background_photons) {
  std::vector<FoundPulse> found;
  for (const Pulse& pulse : pulses) {
    found.push_back({pulse.time_ps, static_cast<double>(pulse.photons)});
  }
  FoldModel model(fold, found, 100);
  model.background_per_ps = std::max(background_photons / double{period_ps}, 1e-6);
  return model;
}

TabulatedPulse table_of(const Truth& truth, double step_ps) {
  TabulatedPulse table{-800, step_ps, {}};
  for (double x = -800; x < 4000; x += step_ps) table.density.push_back(truth.density(x));
  return table;
}

// The photons that each value should hold: those of the fold's bins whose middle is nearest to it.
std::vector<double> expected_stack(const StackedPhotons& stack, const Truth& truth,
                                   const std::vector<Pulse>& pulses, double bin_ps) {
  std::vector<double> expected(stack.net.size());
  for (const Pulse& pulse : pulses) {
    const double first = std::floor((pulse.time_ps - 1000) / bin_ps);
    for (double bin = first; bin < first + 6000 / bin_ps; ++bin) {
      const double off_ps = (bin + 0.5) * bin_ps - pulse.time_ps;
      const double value = std::round((off_ps - stack.first_ps) / stack.step_ps);
      if (value < 0 || value >= static_cast<double>(expected.size())) continue;
      expected[static_cast<std::size_t>(value)] += pulse.photons * truth.density(off_ps) * bin_ps;
    }
  }
  return expected;
}

// Each value is a Poisson count of known mean, less the known background and the known neighbour.
TEST(StackPhotons, HoldsThePhotonsOfAllPulsesByTheirOffset) {
  const Truth truth{0.3, 250};
  // The second pulse stands on the first one's tail, eight widths behind it.
  const std::vector<Pulse> pulses = {{20'000, 60'000}, {20'800, 90'000}, {60'000, 50'000}};
  const auto fold = folded(truth, pulses, 100'000, 1);
  FoldModel model = model_of(*fold, pulses, 100'000);
  model.set_table(table_of(truth, 10));
  const StackedPhotons stack = stack_photons(model);
  const std::vector<double> expected = expected_stack(stack, truth, pulses, fold->bin_ps());
  double chi_square = 0, values = 0, all = 0;
  for (std::size_t j = 0; j < stack.net.size(); ++j) {
    ASSERT_GT(stack.variance[j], 0);
    const double off = stack.net[j] - expected[j];
    EXPECT_LT(std::abs(off), 5 * std::sqrt(stack.variance[j])) << stack.offset_ps(j);
    chi_square += off * off / stack.variance[j];
    values += 1;
    all += expected[j];
  }
  ASSERT_GT(values, 40);
  EXPECT_NEAR(chi_square / values, 1, 4.5 * std::sqrt(2 / values));
  EXPECT_NEAR(all, 200'000, 1'000);  // the stack reaches as far as the pulse
}

// Half a width at 10^4 photons, falling as N^(-1/7), between a half and an eighth.
TEST(StackPhotons, TheStepFollowsTheCounts) {
  const auto fold = folded({}, {{50'000, 1000}}, 0, 1);
  FoldModel model = model_of(*fold, {{50'000, 1000}}, 0);
  const double width_ps = model.width_ps();
  const auto step_at = [&](double counts) {
    model.counts = {counts};
    return stack_photons(model).step_ps / width_ps;
  };
  EXPECT_NEAR(step_at(1e4), 0.5, 1e-9);
  EXPECT_NEAR(step_at(1e4 * 128), 0.25, 1e-9);
  EXPECT_NEAR(step_at(100), 0.5, 1e-9);
  EXPECT_NEAR(step_at(1e12), 0.125, 1e-9);
}

TEST(StackShape, IsTheShapeThatWasDrawnFrom) {
  const Truth truth{0.4, 300};
  const std::vector<Pulse> pulses = {{20'000, 400'000}, {60'000, 400'000}};
  const auto fold = folded(truth, pulses, 200'000, 2);
  FoldModel model = model_of(*fold, pulses, 200'000);
  stack_shape(model);
  const TabulatedPulse& table = model.table();
  EXPECT_NEAR(std::accumulate(table.density.begin(), table.density.end(), 0.0) * table.step_ps, 1,
              1e-9);
  const FoldModel::Window window = model.window(0);
  for (std::size_t i = 0; i < window.h.size(); i += 8) {
    const double x = window.offset_ps[i];
    EXPECT_NEAR(window.h[i], truth.density(x), 0.02 * truth.density(x) + 4e-5) << x;
  }
  // A 400th of the tail lies beyond 1800 ps; nothing is there before -600.
  EXPECT_GT(window.offset_ps.back(), 1800);
  EXPECT_LT(window.offset_ps.back(), 6000);
  EXPECT_GT(window.offset_ps.front(), -700);
}

// A histogram whose steps are a quarter of a width, read as a spline, has 4 (step / sigma)^2 / 12 =
// 2 % more variance than the pulse. A million photons tell the variance to 0.15 %.
TEST(StackShape, IsNoWiderThanThePulse) {
  const std::vector<Pulse> pulses = {{50'000, 1'000'000}};
  const auto fold = folded({}, pulses, 0, 3);
  FoldModel model = model_of(*fold, pulses, 0);
  stack_shape(model);
  const FoldModel::Window window = model.window(0);
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < window.h.size(); ++i) {
    sum += window.h[i];
    squares += window.h[i] * window.offset_ps[i] * window.offset_ps[i];
  }
  EXPECT_NEAR(squares / sum / 1e4, 1, 0.007);
}

// Poisson: with N photons and no background, the values about x count N h(x) step photons.
TEST(StackShape, DeviationsAreThoseOfTheCounts) {
  const std::vector<Pulse> pulses = {{50'000, 200'000}};
  const auto fold = folded({}, pulses, 0, 4);
  FoldModel model = model_of(*fold, pulses, 0);
  stack_shape(model);
  const std::vector<double> deviations = std_density(model);
  const TabulatedPulse& table = model.table();
  ASSERT_EQ(deviations.size(), table.density.size());
  const Truth truth;
  for (std::size_t j = 0; j < deviations.size(); ++j) {
    const double x = table.first_ps + static_cast<double>(j) * table.step_ps;
    if (std::abs(x) > 200) continue;
    const double photons = 200'000 * truth.density(x) * table.step_ps;
    EXPECT_NEAR(deviations[j] * 200'000 * table.step_ps / std::sqrt(photons), 1, 0.06) << x;
  }
}

TEST(PulsePoint, IsTheMeanWeightedWithTheSquaredDensity) {
  const auto fold = folded({}, {{50'000, 1000}}, 0, 1);
  FoldModel model = model_of(*fold, {{50'000, 1000}}, 0);
  TabulatedPulse aside = table_of({}, 5);
  aside.first_ps += 37;
  model.set_table(aside);
  EXPECT_NEAR(pulse_point_ps(model), 37, 0.05);
  // A tail of half the photons and of three widths: 0.54 widths, where the mean moves by 1.5.
  model.set_table(table_of({0.5, 300}, 5));
  EXPECT_NEAR(pulse_point_ps(model), 54, 1);
}

// 1.24 sigma / sqrt(N) for a gaussian without background; and that is what it scatters by.
TEST(PulsePoint, DeviationIsThatOfItsScatter) {
  constexpr int seeds = 40;
  const std::vector<Pulse> pulses = {{50'000, 20'000}};
  double squares = 0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const auto fold = folded({}, pulses, 0, seed);
    FoldModel model = model_of(*fold, pulses, 0);
    stack_shape(model);
    const double std_ps = std_pulse_point_ps(model);
    EXPECT_NEAR(std_ps, 124 / std::sqrt(20'000), 0.06);
    squares += std::pow(pulse_point_ps(model) / std_ps, 2) / seeds;
  }
  EXPECT_NEAR(std::sqrt(squares), 1, 0.45);  // 11 % for 40 values: four of these
}

}  // namespace
}  // namespace splid::calibration
