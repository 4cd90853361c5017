#include "bench/studies/expectation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace splid::studies {
namespace {

// [P] Fig. 4.
const Cell few_photons{.study = Study::fig4,
                       .mode = Mode::random,
                       .length_ms = 10,
                       .signal_per_pulse = 1e-4,
                       .background_per_ns = 1e-5,
                       .velocity_mps = 30};

TEST(Expectation, PhotonsAreThoseOfThePaper) {
  const Expectation forty = expect({.study = Study::fig2, .mode = Mode::interleaved});
  EXPECT_NEAR(forty.signal_photons, 96, 2);
  const Expectation one = expect({.study = Study::fig2, .mode = Mode::baseline});
  EXPECT_NEAR(one.signal_photons, 1.92, 0.02);
  const Expectation few = expect(few_photons);
  EXPECT_NEAR(few.signal_photons, 19, 1);
  EXPECT_NEAR(few.background_photons, 100, 3);
  EXPECT_FALSE(photons_decide(one));
  EXPECT_TRUE(is_easy(forty));
}

// The gain of drawn frames, each photon's taken where it was drawn: mean, deviation and the far
// tail that decides whether a target can be found at all.
TEST(Expectation, GainIsThatOfDrawnFrames) {
  const Cell& cell = few_photons;
  const Expectation e = expect(cell);
  const double flat = (e.signal_photons + e.background_photons) / e.length_ns;
  const auto nats = [&](double offset_ns) {
    const double u = offset_ns / pulse_sigma_ns;
    const double h = std::exp(-u * u / 2) / (pulse_sigma_ns * std::sqrt(2 * M_PI));
    return std::log((cell.background_per_ns + cell.signal_per_pulse * h) / flat);
  };
  std::mt19937_64 random(7);
  std::poisson_distribution<int> signals(e.signal_photons), backgrounds(e.background_photons);
  std::normal_distribution<double> jitter(0, pulse_sigma_ns);
  // Some background falls on pulses: one in 2600 ns / 50.
  std::uniform_real_distribution<double> anywhere(-2600.0 / 100, 2600.0 / 100);
  constexpr int frames = 100'000;
  double sum = 0, squares = 0;
  int lost = 0;
  for (int n = 0; n < frames; ++n) {
    double gain = 0;
    for (int k = signals(random); k > 0; --k) gain += nats(jitter(random));
    for (int k = backgrounds(random); k > 0; --k) gain += nats(anywhere(random));
    sum += gain;
    squares += gain * gain;
    lost += gain < e.threshold_nats - 1.5 ? 1 : 0;
  }
  const double mean = sum / frames;
  EXPECT_NEAR(e.gain_nats, mean, 5 * e.gain_deviation_nats / std::sqrt(frames));
  EXPECT_NEAR(e.gain_deviation_nats / std::sqrt(squares / frames - mean * mean), 1, 0.02);
  EXPECT_NEAR(e.chance_lost, static_cast<double>(lost) / frames, 5 * std::sqrt(lost) / frames);
  EXPECT_GT(lost, 100);
}

// 0.3 ns between the remainders of [P] Fig. 5: with a tenth of the light a frame in 1000 agrees
// better another turn off, with all of it none.
TEST(Expectation, PeriodsOfFig5NeedLight) {
  Cell cell{.study = Study::fig5_whole, .mode = Mode::interleaved, .velocity_mps = 30};
  EXPECT_TRUE(is_easy(expect(cell)));
  cell.signal_per_pulse = 1.9e-3;
  cell.background_per_ns = 1e-5;
  EXPECT_GT(expect(cell).chance_lost, 1e-4);
  EXPECT_LT(expect(cell).chance_lost, 3e-2);
}

// Least squares through drawn photons, the arrival's errors drawn too.
TEST(CountFloor, IsWhatAStraightLineThroughKnownPhotonsReaches) {
  const Expectation e = expect({.study = Study::fig3,
                                .mode = Mode::random,
                                .length_ms = 0.1,
                                .signal_per_pulse = 0.01,
                                .background_per_ns = 1e-6});
  EXPECT_NEAR(e.signal_photons, 19, 1);
  std::mt19937_64 random(3);
  std::poisson_distribution<int> count(e.signal_photons);
  std::uniform_real_distribution<double> place(-0.5, 0.5);
  std::normal_distribution<double> jitter(0, pulse_sigma_ns);
  constexpr int frames = 100'000;
  double delay = 0, travel = 0;
  for (int frame = 0; frame < frames; ++frame) {
    const int n = std::max(5, count(random));
    double u1 = 0, u2 = 0, r = 0, ru = 0;
    for (int k = 0; k < n; ++k) {
      const double u = place(random), error = jitter(random);
      u1 += u / n;
      u2 += u * u / n;
      r += error / n;
      ru += error * u / n;
    }
    const double slope = (ru - r * u1) / (u2 - u1 * u1);
    travel += slope * slope / frames;
    delay += std::pow(r - slope * u1, 2) / frames;
  }
  const CountFloor floor = count_floor(e.bound);
  EXPECT_NEAR(floor.delay, std::sqrt(delay) / e.bound.delay_ns, 0.01);
  const double travel_bound = std::sqrt(12.0) * e.bound.delay_ns;
  EXPECT_NEAR(floor.velocity, std::sqrt(travel) / travel_bound, 0.015);
  EXPECT_GT(floor.velocity, 1.04);
}

TEST(CountFloor, IsNoneWithManyPhotons) {
  const CountFloor floor = count_floor(expect({.study = Study::experiment,
                                               .mode = Mode::interleaved,
                                               .length_ms = 50,
                                               .signal_per_pulse = 13.5e-4,
                                               .background_per_ns = 1.75e-4})
                                           .bound);
  EXPECT_NEAR(floor.delay, 1, 0.003);
  EXPECT_NEAR(floor.velocity, 1, 0.005);
}

}  // namespace
}  // namespace splid::studies
