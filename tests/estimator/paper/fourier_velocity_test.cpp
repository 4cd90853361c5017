#include "estimator/paper/fourier_velocity.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

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

}  // namespace
}  // namespace splid::paper
