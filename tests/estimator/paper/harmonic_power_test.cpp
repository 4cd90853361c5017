#include "estimator/paper/harmonic_power.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/estimator/paper/train_maker.hpp"

namespace splid::paper {
namespace {

// The squares of the photons in each bin, shared between neighbours and smoothed by 1, 2, 1.
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

TEST(HarmonicPower, IsTheSumOfSquaresOfTheSmoothedFold) {
  test::TrainMaker made;
  for (const std::size_t bins : {4U, 13U, 945U}) {
    // More photons than are folded in one go, and fewer.
    for (const double background_per_ns : {1e-4, 5e-3}) {
      made.background_per_ns = background_per_ns;
      const TrainPhotons photons = made.make(1);
      HarmonicPower power(photons, bins);
      for (const double rate : {0.0, 5e-7, -1e-6, 1e-3}) {
        const double expected = plain_power(photons, bins, rate);
        EXPECT_NEAR(power(rate), expected, 1e-7 * expected) << bins << ' ' << rate;
      }
    }
  }
}

TEST(HarmonicPower, GoesAroundTheCircle) {
  TrainPhotons photons;
  photons.period_ns = 8;
  photons.time_ns = {0, 0, 0};
  photons.phase_ns = {0, 7.5, 7.999999999999999};
  for (const double shift_ns : {0.0, 0.3, 0.5, 4.0}) {
    TrainPhotons shifted = photons;
    for (double& phase_ns : shifted.phase_ns) phase_ns = fold_on(phase_ns + shift_ns, 8);
    HarmonicPower power(shifted, 8);
    EXPECT_NEAR(power(0), plain_power(shifted, 8, 0), 1e-9) << shift_ns;
  }
}

}  // namespace
}  // namespace splid::paper
