#include "estimator/paper/rate_scan.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/estimator/paper/train_maker.hpp"

namespace splid::paper {
namespace {

// The best of all rates, one by one.
double plain_best_rate(HarmonicPower& power, double step, int steps) {
  double best = 0;
  double largest = 0;
  for (int n = -steps; n <= steps; ++n) {
    const double here = power(n * step);
    if (here <= largest) continue;
    largest = here;
    best = n * step;
  }
  return best;
}

struct RateScene {
  const char* name;
  test::TrainMaker made;
};

// A single pulse, one of the periods of the other modes, and an interleaved pattern's sub-period,
// as in [P]'s experiment: with the light of that experiment, with hardly any, and with a lot.
std::vector<RateScene> scenes() {
  std::vector<RateScene> all;
  for (const double velocity_mps : {0.0, -137.0}) {
    test::TrainMaker made;
    made.velocity_mps = velocity_mps;
    made.background_per_ns = 1.75e-4;
    made.length_ns = 2e7;
    for (const double period_ns : {3780.0, 189.0, 94.5}) {
      made.period_ns = period_ns;
      for (const double signal : {0.0, 40.0, 290.0, 2e4}) {
        made.signal = signal;
        all.push_back({"experiment", made});
      }
    }
    // As many photons in one bin as no byte holds.
    made.length_ns = 5e6;
    made.signal = 5e4;
    all.push_back({"bright", made});
  }
  return all;
}

TEST(RateScan, FindsTheBestOfAllRates) {
  int frames = 0;
  int others = 0;
  for (const RateScene& scene : scenes()) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const TrainPhotons photons = scene.made.make(seed);
      const auto bins = static_cast<std::size_t>(photons.period_ns / 0.1);
      HarmonicPower power(photons, bins);
      const double step = 0.1 / scene.made.length_ns;
      const int steps = static_cast<int>(std::ceil(1e-6 / step));
      const double found = best_rate(power, step, steps);
      const double expected = plain_best_rate(power, step, steps);
      ++frames;
      others += found == expected ? 0 : 1;
      if (scene.made.signal >= 290 && scene.made.period_ns < 1000) {
        EXPECT_EQ(found, expected) << scene.name << ' ' << photons.period_ns << ' ' << seed;
      }
    }
  }
  // Where there is nothing to find, the largest noise may be missed in a frame of 200.
  EXPECT_LE(others, frames / 50);
}

// Few photons, few rates: all are tried.
TEST(RateScan, MissesNoneOfFew) {
  test::TrainMaker made;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U}) {
    made.signal = 4;
    made.length_ns = 1e7;
    made.background_per_ns = 1e-6;
    const TrainPhotons few = made.make(seed);
    HarmonicPower power(few, 945);
    EXPECT_EQ(best_rate(power, 1e-8, 100), plain_best_rate(power, 1e-8, 100));
    made.signal = 95;
    made.background_per_ns = 1e-3;
    made.length_ns = 5e5;
    const TrainPhotons photons = made.make(seed);
    HarmonicPower other(photons, 945);
    for (const int steps : {0, 1, 6}) {
      EXPECT_EQ(best_rate(other, 2e-7, steps), plain_best_rate(other, 2e-7, steps));
    }
  }
}

}  // namespace
}  // namespace splid::paper
