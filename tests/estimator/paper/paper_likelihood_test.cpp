#include "estimator/paper/paper_likelihood.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "protocol/pattern_make.hpp"
#include "tests/estimator/paper/paper_scene.hpp"

namespace splid::paper {
namespace {

// [P] Eq. 2 over every emission time whose light may matter, and Eq. 4 with its logarithm: plain
// loops in long double.
long double brute_force(const test::PaperScene& scene, const PaperParameters& at) {
  const long double beta = at.velocity_mps / 299792458.0L;
  const long double scale = scene.times.scale;
  const long double period = scene.emission.period_ns() * scale;
  const long double tau = at.delay_ns * scale;
  const long double length = (scene.frame.end_ps - scene.frame.start_ps) * 1e-3L;
  const long double sigma = scene.made.sigma_ns;
  long double value = 0;
  for (const std::int64_t photon_ps : scene.frame.photons_ps) {
    const long double t = (photon_ps - scene.frame.start_ps) * 1e-3L;
    long double density = 0;
    const auto turn = static_cast<std::int64_t>(std::floor((t - tau) / period));
    for (std::int64_t k = turn - 1; k <= turn + 1; ++k) {
      long double begin = static_cast<long double>(k) * period;
      for (const PatternSegment& segment : scene.made.pattern.segments) {
        const auto repeats = scene.made.pattern.segments.size() == 1 ? 1 : segment.repeats;
        for (std::int64_t n = 0; n < repeats; ++n) {
          for (std::size_t p = 0; p < segment.pulse_times_ps.size(); ++p) {
            const long double e = begin + (static_cast<long double>(n) * segment.period_ps +
                                           segment.pulse_times_ps[p]) *
                                              1e-3L * scale;
            const long double x = (t - tau / (1 - beta) - e * (1 + beta) / (1 - beta)) / sigma;
            density += segment.amplitudes[p] * std::exp(-x * x / 2);
          }
        }
        begin += static_cast<long double>(repeats) * segment.period_ps * 1e-3L * scale;
      }
    }
    density /= sigma * std::sqrt(2 * std::numbers::pi_v<long double>);
    value += std::log(at.background_per_ns + at.signal_per_pulse * density);
  }
  const long double amplitude = scene.emission.train().amplitude_per_ns * length / scale;
  return value - at.background_per_ns * length -
         at.signal_per_pulse * amplitude * (1 - beta) / (1 + beta);
}

double gain_of(const test::PaperScene& scene, const PaperParameters& at) {
  PaperLikelihood likelihood(scene.times, scene.emission, *scene.shape);
  likelihood.move_to(at.delay_ns, at.velocity_mps);
  return likelihood.evaluate(at.signal_per_pulse, at.background_per_ns).gain_nats;
}

void expect_brute_force(const test::PaperScene& scene) {
  const double n = static_cast<double>(scene.frame.photons_ps.size());
  const double flat = n * std::log(n / (scene.times.seen_ns * scene.times.scale)) - n;
  for (const PaperParameters& off : {PaperParameters{0, 0, 0.02, 1e-3},
                                     {0.07, -1.4, 0.001, 5e-4},
                                     {-0.3, 9, 1e-9, 1e-9},
                                     {0.1, 0, 3, 0.1}}) {
    PaperParameters at = off;
    at.delay_ns += scene.delay_start_ns();
    at.velocity_mps += scene.made.velocity_mps;
    const auto expected = static_cast<double>(brute_force(scene, at) - flat);
    EXPECT_NEAR(gain_of(scene, at), expected, 1e-9 * (std::abs(expected) + std::abs(flat)));
  }
}

TEST(PaperLikelihood, AgreesWithALongDoubleDoubleLoop) {
  const std::vector<double> subperiods_ps = {180000, 189000};
  test::FrameMaker made = test::simulated_scene(make_interleaved(subperiods_ps), 31);
  for (std::size_t p = 0; p < 40; ++p) {
    made.pattern.segments[0].amplitudes[p] = 0.5 + static_cast<double>(p) / 40;
  }
  expect_brute_force({made, 1});
  made.drift_ppm = 100;
  made.start_ps = 340000000000000000;
  expect_brute_force({made, 2});
  made.sigma_ns = 5;  // pulses are 9 ns apart
  expect_brute_force({made, 3});
  test::FrameMaker mrr = test::simulated_scene(
      make_mrr(std::vector<double>{90000, 99000}, std::vector<std::int64_t>{20, 30}), -140);
  mrr.drift_ppm = -50;
  expect_brute_force({mrr, 4});
}

TEST(PaperLikelihood, GradientAgreesWithDifferences) {
  for (const double sigma_ns : {0.1, 5.0}) {
    test::FrameMaker made = test::simulated_scene(make_random({}), 31);
    made.sigma_ns = sigma_ns;
    made.drift_ppm = 100;
    const test::PaperScene scene(made, 1);
    const PaperParameters at = {scene.delay_start_ns() + 0.3 * sigma_ns, 31 - 70 * sigma_ns, 0.01,
                                2e-3};
    PaperLikelihood likelihood(scene.times, scene.emission, *scene.shape);
    likelihood.move_to(at.delay_ns, at.velocity_mps);
    const auto point = likelihood.evaluate(at.signal_per_pulse, at.background_per_ns);
    const auto slope = [&](double PaperParameters::*which, double step) {
      PaperParameters up = at;
      PaperParameters down = at;
      up.*which += step;
      down.*which -= step;
      return (gain_of(scene, up) - gain_of(scene, down)) / (2 * step);
    };
    const auto expect = [](double found, double numeric) {
      EXPECT_NEAR(found, numeric, 1e-6 * std::abs(numeric) + 1e-7);
    };
    expect(point.by_delay, slope(&PaperParameters::delay_ns, 1e-4 * sigma_ns));
    expect(point.by_velocity, slope(&PaperParameters::velocity_mps, 0.03 * sigma_ns));
    expect(point.by_signal, slope(&PaperParameters::signal_per_pulse, 1e-6));
    expect(point.by_background, slope(&PaperParameters::background_per_ns, 1e-7));
  }
}

std::vector<double> values_at(PaperLikelihood& likelihood, double delay_ns, double velocity_mps) {
  likelihood.move_to(delay_ns, velocity_mps);
  const auto point = likelihood.evaluate(0.013, 9e-4);
  return {point.gain_nats, point.by_delay, point.by_velocity, point.by_signal, point.by_background};
}

// Small moves, moves about the margin within which photons are not looked for anew, and far ones.
TEST(PaperLikelihood, DoesNotDependOnWhereItWasBefore) {
  const std::vector<double> subperiods_ps = {180000, 189000};
  const std::vector<double> rates_ps = {90000, 99000};
  const std::vector<std::int64_t> repeats = {20, 30};
  for (const Pattern& pattern :
       {make_interleaved(subperiods_ps), make_random({}), make_mrr(rates_ps, repeats)}) {
    test::FrameMaker made = test::simulated_scene(pattern, 31);
    made.drift_ppm = 100;
    const test::PaperScene scene(made, 1);
    PaperLikelihood moved(scene.times, scene.emission, *scene.shape);
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    double delay_ns = scene.delay_start_ns();
    double velocity_mps = 31;
    for (int n = 0; n < 300; ++n) {
      const double widths = n % 10 == 0 ? 30 : n % 3 == 0 ? 3 : 0.3;
      delay_ns += 0.1 * widths * normal(random);
      velocity_mps += 30 * widths * normal(random);  // 30 m/s: a width in the frame's 0.5 ms
      PaperLikelihood fresh(scene.times, scene.emission, *scene.shape);
      ASSERT_EQ(values_at(moved, delay_ns, velocity_mps), values_at(fresh, delay_ns, velocity_mps))
          << n;
      if (n % 10 == 0) delay_ns = scene.delay_start_ns();
      if (n % 10 == 0) velocity_mps = 31;
    }
  }
}

// (1 - beta) / (1 + beta) in doubles would show no change here at all.
TEST(PaperLikelihood, FeelsTenNanometresASecond) {
  test::FrameMaker made = test::simulated_scene(make_random({}), 0);
  made.length_ms = 50;
  const test::PaperScene scene(made, 1);
  PaperLikelihood likelihood(scene.times, scene.emission, *scene.shape);
  const auto by_velocity = [&](double velocity_mps) {
    likelihood.move_to(scene.delay_start_ns(), velocity_mps);
    return likelihood.evaluate(0.018, 1e-3).by_velocity;
  };
  const double curvature = (by_velocity(1e-3) - by_velocity(-1e-3)) / 2e-3;
  EXPECT_NEAR((by_velocity(1e-8) - by_velocity(0)) / 1e-8 / curvature, 1, 0.1);
}

// A loss takes its share of the expected counts, in the tagger's clock.
TEST(PaperLikelihood, ALossIsNotSeen) {
  test::FrameMaker made = test::simulated_scene(make_random({}), 0);
  made.drift_ppm = 200;
  test::FrameMaker::Frame frame = made.make(1);
  const std::int64_t middle_ps = (frame.start_ps + frame.end_ps) / 2;
  frame.losses = {{middle_ps, frame.end_ps, 100}};
  std::erase_if(frame.photons_ps, [&](std::int64_t t) { return t >= middle_ps; });
  const test::PaperScene scene(made, frame);
  PaperLikelihood likelihood(scene.times, scene.emission, *scene.shape);
  likelihood.move_to(scene.delay_start_ns(), 0);
  const auto point = likelihood.evaluate(0, 1);
  EXPECT_NEAR(likelihood.seen_ns(), static_cast<double>(middle_ps - frame.start_ps) * 1e-3, 1e-6);
  EXPECT_NEAR(point.by_background + likelihood.seen_ns(),
              static_cast<double>(frame.photons_ps.size()), 1e-9);
  EXPECT_NEAR(likelihood.amplitude(), 40 / 3780.0 * likelihood.seen_ns() / 1.0002, 1e-6);
}

}  // namespace
}  // namespace splid::paper
