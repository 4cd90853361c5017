#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "estimator/paper/train_photons.hpp"
#include "tests/estimator/paper/train_maker.hpp"

namespace splid::paper {
namespace {

// The power of sum_j exp(2 pi i h f' T_j) with each harmonic's share of a gaussian pulse, as
// written.
double power_of(const TrainPhotons& photons, double velocity_mps, double sigma_ns) {
  const long double rate = 2 * velocity_mps / (299792458.0L + velocity_mps);
  double power = 0;
  const int harmonics = static_cast<int>(photons.period_ns / (2 * std::numbers::pi * sigma_ns) * 2);
  for (int h = 1; h <= harmonics; ++h) {
    std::complex<double> sum = 0;
    for (std::size_t j = 0; j < photons.size(); ++j) {
      const auto turns = static_cast<double>((photons.phase_ns[j] - rate * photons.time_ns[j]) * h /
                                             photons.period_ns);
      sum += std::polar(1.0, 2 * std::numbers::pi * turns);
    }
    const double width = 2 * std::numbers::pi * h * sigma_ns / photons.period_ns;
    power += std::exp(-width * width) * std::norm(sum);
  }
  return power;
}

// How far the line is off at the ends of the train, in pulse widths.
double off_widths(const test::TrainMaker& made, double velocity_mps) {
  return std::abs(velocity_mps - made.velocity_mps) * 2 / 299792458.0 * made.length_ns / 2 /
         made.sigma_ns;
}

TEST(FourierVelocity, IsWhereThePowerOfTheHarmonicsIsLargest) {
  test::TrainMaker made;
  made.length_ns = 5e6;
  made.signal = 150;
  made.background_per_ns = 2e-5;
  for (const std::uint64_t seed : {1U, 2U}) {
    const TrainPhotons photons = made.make(seed);
    const double found = fourier_velocity_mps(photons, made.sigma_ns, 150);
    double most = 0;
    for (double v = -150; v <= 150; v += 3) {
      most = std::max(most, power_of(photons, v, made.sigma_ns));
    }
    EXPECT_GT(power_of(photons, found, made.sigma_ns), 0.97 * most);
  }
}

TEST(FourierVelocity, BringsTheLineWithinReachOfRefinement) {
  for (const double velocity : {0.0, 10.0, -77.0, 140.0}) {
    test::TrainMaker made;
    made.velocity_mps = velocity;
    // [P]'s simulation, and its experiment with 40 pulses in 3780 ns.
    for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U}) {
      EXPECT_LT(off_widths(made, fourier_velocity_mps(made.make(seed), 0.1, 150)), 2);
    }
    made.length_ns = 5e7;
    made.signal = 714;
    made.background_per_ns = 1.75e-4;
    EXPECT_LT(off_widths(made, fourier_velocity_mps(made.make(6), 0.1, 150)), 1);
  }
}

TEST(FourierVelocity, KeepsToTheSpeedsAllowed) {
  test::TrainMaker made;
  made.velocity_mps = 149.9;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    EXPECT_LE(std::abs(fourier_velocity_mps(made.make(seed), 0.1, 150)), 150);
    EXPECT_EQ(fourier_velocity_mps(made.make(seed), 0.1, 0), 0);
  }
}

TEST(FourierVelocity, OfNothingIsZero) {
  TrainPhotons photons;
  photons.period_ns = 94.5;
  EXPECT_EQ(fourier_velocity_mps(photons, 0.1, 150), 0);
  photons.phase_ns = {3, 3, 3};
  photons.time_ns = {50, 50, 50};
  EXPECT_EQ(fourier_velocity_mps(photons, 0.1, 150), 0);
  photons.time_ns = {0, 50, 100};
  EXPECT_EQ(fourier_velocity_mps(photons, 94.5, 150), 0);
}

// The squares of the photons in each bin, shared between neighbours and smoothed by 1, 2, 1.
double power_of_fold(const TrainPhotons& photons, std::size_t bins, double rate) {
  double power = 0;
  for (const double smooth : smoothed_fold(photons, bins, rate)) power += smooth * smooth;
  return power;
}

// The same, as written.
double plain_power(const TrainPhotons& photons, std::size_t bins, double rate) {
  std::vector<double> counts(bins);
  for (std::size_t i = 0; i < photons.size(); ++i) {
    const double phase_ns =
        fold_on(photons.phase_ns[i] - rate * photons.time_ns[i], photons.period_ns);
    const double place = phase_ns / photons.period_ns * static_cast<double>(bins);
    const double bin = std::floor(place);
    counts[static_cast<std::size_t>(bin) % bins] += 1 - (place - bin);
    counts[(static_cast<std::size_t>(bin) + 1) % bins] += place - bin;
  }
  double power = 0;
  for (std::size_t k = 0; k < bins; ++k) {
    const double smooth = counts[k] + 2 * counts[(k + 1) % bins] + counts[(k + 2) % bins];
    power += smooth * smooth;
  }
  return power;
}

TEST(SmoothedFold, IsAsWritten) {
  test::TrainMaker made;
  for (const std::size_t bins : {4U, 13U, 945U}) {
    for (const double background_per_ns : {1e-4, 5e-3}) {
      made.background_per_ns = background_per_ns;
      const TrainPhotons photons = made.make(1);
      for (const double rate : {0.0, 5e-7, -1e-6, 1e-3}) {
        const double expected = plain_power(photons, bins, rate);
        EXPECT_NEAR(power_of_fold(photons, bins, rate), expected, 1e-7 * expected)
            << bins << ' ' << rate;
      }
    }
  }
}

TEST(SmoothedFold, GoesAroundTheCircle) {
  TrainPhotons photons;
  photons.period_ns = 8;
  photons.time_ns = {0, 0, 0};
  photons.phase_ns = {0, 7.5, 7.999999999999999};
  for (const double shift_ns : {0.0, 0.3, 0.5, 4.0}) {
    TrainPhotons shifted = photons;
    for (double& phase_ns : shifted.phase_ns) phase_ns = fold_on(phase_ns + shift_ns, 8);
    EXPECT_NEAR(power_of_fold(shifted, 8, 0), plain_power(shifted, 8, 0), 1e-9) << shift_ns;
  }
}

}  // namespace
}  // namespace splid::paper
