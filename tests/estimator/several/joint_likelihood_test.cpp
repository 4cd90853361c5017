#include "estimator/several/joint_likelihood.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "estimator/likelihood/log_likelihood.hpp"
#include "estimator/several/joint_fit.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

constexpr double joint_c_m_per_ns = 0.299792458;

// [P]'s pulses, no two of the same amplitude; and twice as many, in pairs 1.5 ns apart, so that
// photons are near both of a pair.
Pattern uneven(Pattern pattern) {
  double amplitude = 1;
  for (double& a : pattern.segments.front().amplitudes) a = amplitude += 0.02;
  return pattern;
}
Pattern wide_pattern() { return uneven(test::interleaved_pattern({180000, 189000}, 3780000)); }
Pattern crowded_pattern() {
  Pattern pattern = wide_pattern();
  PatternSegment& segment = pattern.segments.front();
  std::vector<double> times_ps;
  for (const double time_ps : segment.pulse_times_ps) {
    times_ps.push_back(time_ps);
    times_ps.push_back(time_ps + 1500);
  }
  segment.pulse_times_ps = times_ps;
  segment.amplitudes.assign(times_ps.size(), 1);
  return uneven(pattern);
}

// Targets in a short frame: behind the first one each has its own distance, is 5 m/s faster than
// the one before it, and has two thirds of its signal.
struct SomeTargets {
  std::vector<test::FrameMaker> makers;
  test::FrameMaker::Frame frame;
  PulseTrain train;
  FoldedFrame folded;
  std::unique_ptr<PulseShape> shape;
  JointParameters truth;

  static DelayLine line_of(const test::FrameMaker& made, const FoldedFrame& folded) {
    const double beta = made.velocity_mps / 299792458.0;
    return {2 * made.distance_m / joint_c_m_per_ns / (1 + beta) / folded.scale,
            2 * beta / (1 + beta) * folded.length_ns};
  }
  static std::vector<test::FrameMaker> make(const std::vector<double>& offs_ns,
                                            const Pattern& pattern) {
    std::vector<test::FrameMaker> made(offs_ns.size() + 1);
    for (std::size_t k = 0; k < made.size(); ++k) {
      made[k].pattern = pattern;
      made[k].length_ms = 2;
      made[k].distance_m += k > 0 ? offs_ns[k - 1] * joint_c_m_per_ns / 2 : 0;
      made[k].velocity_mps = 31 + 5 * static_cast<double>(k);
      made[k].signal_per_pulse = 0.01 * std::pow(0.6, static_cast<double>(k));
    }
    return made;
  }
  explicit SomeTargets(const std::vector<double>& offs_ns = {0.3},
                       const Pattern& pattern = wide_pattern())
      : makers(make(offs_ns, pattern)),
        frame(makers.front().make_with({makers.begin() + 1, makers.end()}, 11)),
        train(pattern),
        folded(train, frame.photons_ps.size()),
        shape(make_gaussian(makers.front().sigma_ns)) {
    folded.fold(frame.view(), train);
    for (const test::FrameMaker& made : makers) {
      truth.add({line_of(made, folded), made.signal_per_pulse});
    }
    truth.background_per_ns = 1.75e-4;
  }
  [[nodiscard]] JointLikelihood likelihood() const {
    JointLikelihood made(*shape, train, folded.size(), 0.4);
    made.collect(folded, truth);
    return made;
  }
  [[nodiscard]] Exposure exposure() const { return {folded, train}; }
};

// Two and more, close and far from each other, and some that share photons in all ways.
std::vector<SomeTargets> all_scenes() {
  std::vector<SomeTargets> scenes;
  for (const std::vector<double>& offs_ns :
       {std::vector{0.1}, {0.3}, {40.0}, {0.4, 0.9}, {0.5, 1.0, 40.0}, {0.5, 1.8, 3.5}}) {
    scenes.emplace_back(offs_ns);
  }
  scenes.emplace_back(std::vector{0.4}, crowded_pattern());
  scenes.emplace_back(std::vector{0.5, 40.0}, crowded_pattern());
  return scenes;
}

// -integral lambda + sum log lambda with [P] Eq. 2 for each target, over every pulse that may
// matter: plain loops in long double, from tau and v, not from lines.
long double by_brute_force(const SomeTargets& scene, const std::vector<long double>& taus_ns,
                           const std::vector<long double>& speeds_mps,
                           const std::vector<long double>& signals, long double b) {
  const auto& segment = scene.makers.front().pattern.segments.front();
  const long double period = static_cast<long double>(scene.frame.sync.period_ps) * 1e-3L;
  const long double sigma = scene.makers.front().sigma_ns;
  const std::int64_t mid_ps =
      scene.frame.start_ps + (scene.frame.end_ps - scene.frame.start_ps) / 2;
  const long double start = static_cast<long double>(scene.frame.start_ps - mid_ps) * 1e-3L;
  const long double length = -2 * start;
  long double amplitude = 0;
  for (const double a : segment.amplitudes) amplitude += a;
  long double value = -b * length;
  for (std::size_t n = 0; n < taus_ns.size(); ++n) {
    const long double beta = speeds_mps[n] / 299792458.0L;
    value -= signals[n] * amplitude * length / period * (1 - beta) / (1 + beta);
  }
  for (const std::int64_t photon : scene.frame.photons_ps) {
    const long double t = static_cast<long double>(photon - mid_ps) * 1e-3L;
    long double lambda = b;
    for (std::size_t n = 0; n < taus_ns.size(); ++n) {
      const long double beta = speeds_mps[n] / 299792458.0L;
      const auto turn = static_cast<std::int64_t>(std::floor((t - taus_ns[n] - start) / period));
      for (std::int64_t k = turn - 1; k <= turn + 1; ++k) {
        for (std::size_t p = 0; p < segment.pulse_times_ps.size(); ++p) {
          const long double e =
              start + k * period + segment.pulse_times_ps[p] * period / segment.period_ps;
          const long double x = (t - taus_ns[n] / (1 - beta) - e * (1 + beta) / (1 - beta)) / sigma;
          lambda += signals[n] * segment.amplitudes[p] * std::exp(-x * x / 2) /
                    (sigma * std::sqrt(2 * std::numbers::pi_v<long double>));
        }
      }
    }
    value += std::log(lambda);
  }
  return value;
}

TEST(JointLikelihood, AgreesWithLongDoubleLoops) {
  for (const SomeTargets& scene : all_scenes()) {
    JointLikelihood likelihood = scene.likelihood();
    JointPoint point;
    JointParameters at = scene.truth;
    at.targets[0].line.delay_ns += 0.05;
    at.targets[1].line.travel_ns -= 0.03;
    at.background_per_ns = 2e-4;
    likelihood.evaluate(scene.exposure(), at, point);
    std::vector<long double> taus_ns, speeds_mps, signals;
    for (std::size_t k = 0; k < at.count; ++k) {
      const TargetParameters& target = at.targets[k];
      const long double g = target.line.travel_ns / scene.folded.length_ns;
      const long double beta = g / (2 - g);
      taus_ns.push_back(target.line.delay_ns * (1 + beta));
      speeds_mps.push_back(beta * 299792458.0L);
      signals.push_back(target.signal_per_pulse);
    }
    const auto expected =
        static_cast<double>(by_brute_force(scene, taus_ns, speeds_mps, signals, 2e-4L));
    EXPECT_NEAR(point.value, expected, 1e-9 * std::abs(expected)) << at.count;
    EXPECT_NEAR(likelihood.value(scene.exposure(), at), expected, 1e-9 * std::abs(expected));
  }
}

TEST(JointLikelihood, DerivativesAgreeWithDifferences) {
  for (const SomeTargets& scene : all_scenes()) {
    JointLikelihood likelihood = scene.likelihood();
    JointParameters at = scene.truth;
    at.targets[0].line.delay_ns += 0.02;
    at.targets[1].signal_per_pulse *= 1.3;
    const auto size = static_cast<Eigen::Index>(at.size());
    const auto shifted = [&](Eigen::Index i, double by) {
      JointParameters p = at;
      TargetParameters& target = p.targets.at(static_cast<std::size_t>(i / 3) % at.count);
      (i == size - 1 ? p.background_per_ns
       : i % 3 == 0  ? target.line.delay_ns
       : i % 3 == 1  ? target.line.travel_ns
                     : target.signal_per_pulse) += by;
      JointPoint point;
      likelihood.evaluate(scene.exposure(), p, point);
      return point;
    };
    const JointPoint point = shifted(0, 0);
    const double steps[] = {1e-5, 1e-5, 1e-7};
    for (Eigen::Index i = 0; i < size; ++i) {
      const double step = i == size - 1 ? 1e-8 : steps[i % 3];
      const JointPoint up = shifted(i, step), down = shifted(i, -step);
      const double slope = (up.value - down.value) / (2 * step);
      const double spread = std::sqrt(std::abs(point.hessian(i, i)));
      EXPECT_NEAR(point.gradient[i], slope, 1e-4 * spread + 1e-6 * std::abs(slope)) << i;
      for (Eigen::Index j = 0; j < size; ++j) {
        const double curved = (up.gradient[j] - down.gradient[j]) / (2 * step);
        const double scale = std::sqrt(std::abs(point.hessian(i, i) * point.hessian(j, j)));
        EXPECT_NEAR(point.hessian(i, j), curved, 1e-4 * scale) << i << " " << j;
      }
    }
  }
}

TEST(JointLikelihood, IsThatOfLikelihoodForOneTarget) {
  const SomeTargets scene;
  JointParameters one;
  one.add(scene.truth.targets[0]);
  one.background_per_ns = 3e-4;
  JointLikelihood joint(*scene.shape, scene.train, scene.folded.size(), 0.4);
  joint.collect(scene.folded, one);
  JointPoint point;
  joint.evaluate(scene.exposure(), one, point);
  likelihood::LogLikelihood single(*scene.shape, scene.train, scene.folded.size(), {});
  single.begin(scene.folded);
  const DelayLine line = one.targets[0].line;
  likelihood::Model model;
  model.add({{line.delay_ns, line.travel_ns}, 0.01});
  model.background_per_ns = 3e-4;
  single.collect(model, NearSet::gathered_from);
  likelihood::Point expected;
  single.evaluate(model, likelihood::free_set(1, 2), expected);
  EXPECT_NEAR(point.value, expected.value, 1e-9 * std::abs(expected.value));
  const std::array<Eigen::Index, 4> places = {0, 1, 3, 5};
  for (Eigen::Index a = 0; a < 4; ++a) {
    const Eigen::Index i = places.at(static_cast<std::size_t>(a));
    EXPECT_NEAR(point.gradient[a], expected.gradient[i], 2e-5 * std::sqrt(-expected.hessian(i, i)));
    EXPECT_NEAR(point.hessian(a, a), expected.hessian(i, i),
                1e-6 * std::abs(expected.hessian(i, i)));
  }
}

// Lines that moved little keep their photons; one that moved far, and one that came, get theirs.
TEST(JointLikelihood, HoldsThePhotonsThatStillServe) {
  const SomeTargets scene({40.0});
  JointLikelihood held(*scene.shape, scene.train, scene.folded.size(), 0.4);
  JointParameters at;
  at.background_per_ns = 1.75e-4;
  at.add({{scene.truth.targets[0].line.delay_ns + 0.2, scene.truth.targets[0].line.travel_ns}, 1});
  held.collect(scene.folded, at);
  at = scene.truth;
  at.targets[1].line.delay_ns += 7;
  for (const double back_ns : {0.0, 7.0}) {
    at.targets[1].line.delay_ns -= back_ns;
    EXPECT_FALSE(held.serves(at));
    held.hold(scene.folded, at);
    EXPECT_TRUE(held.serves(at));
    JointLikelihood fresh = scene.likelihood();
    fresh.collect(scene.folded, at);
    const double expected = fresh.value(scene.exposure(), at);
    EXPECT_NEAR(held.value(scene.exposure(), at), expected, 1e-12 * std::abs(expected));
  }
}

// What is left when both are taken out is background: as many photons as it has, to within 4
// deviations, near the targets' pulses and elsewhere.
TEST(JointLikelihood, WhatIsLeftWithoutTheTargetsIsBackground) {
  const SomeTargets scene;
  JointLikelihood likelihood = scene.likelihood();
  std::vector<std::uint8_t> stays;
  likelihood.thin(scene.exposure(), scene.truth, stays);
  const auto count = [&](unsigned bit) {
    return static_cast<double>(std::count_if(
        stays.begin(), stays.end(), [&](std::uint8_t bits) { return (bits >> bit & 1U) != 0; }));
  };
  const double expected = 1.75e-4 * scene.folded.seen_ns;
  EXPECT_NEAR(count(JointLikelihood::stays_without_any), expected, 4 * std::sqrt(expected));
  ASSERT_GT(static_cast<double>(stays.size()), expected + 300);
  for (const std::size_t k : {0, 1}) {
    const double with_one =
        expected + scene.truth.targets[k].signal_per_pulse * scene.exposure().amplitude;
    EXPECT_NEAR(count(static_cast<unsigned>(k)), with_one, 4 * std::sqrt(with_one));
  }
}

// The value without a target is the largest that the rates of the others allow: no rate that is
// moved by a thousandth or by a tenth makes it larger.
TEST(JointLikelihood, WithoutATargetTheOthersRatesAreTheirBest) {
  for (const SomeTargets& scene : all_scenes()) {
    JointLikelihood likelihood = scene.likelihood();
    for (std::size_t without = 0; without < scene.truth.count; ++without) {
      const double all = likelihood.value(scene.exposure(), scene.truth);
      const double best = likelihood.best_without(without, scene.exposure(), scene.truth, all);
      JointParameters at = scene.truth;
      at.targets[without].signal_per_pulse = 0;
      double highest = likelihood.value(scene.exposure(), at);
      for (double by = 0.1; by > 1e-4;) {
        bool is_higher = false;
        for (std::size_t i = 0; i <= at.count; ++i) {
          for (const double factor : {1 + by, 1 / (1 + by)}) {
            JointParameters tried = at;
            (i < at.count ? tried.targets[i].signal_per_pulse : tried.background_per_ns) *= factor;
            const double value = likelihood.value(scene.exposure(), tried);
            if (value <= highest) continue;
            highest = value;
            at = tried;
            is_higher = true;
          }
        }
        if (!is_higher) by /= 2;
      }
      EXPECT_NEAR(best, highest, std::max(0.02, 1e-4 * (all - highest)))
          << scene.truth.count << " " << without;
    }
  }
}

// Counts and moments are those about the line that is asked for, which is not the one about which
// the photons were collected.
TEST(JointLikelihood, MomentsAreThoseAboutTheLineAskedFor) {
  const SomeTargets scene({40.0});
  const JointLikelihood likelihood = scene.likelihood();
  DelayLine line = scene.truth.targets[0].line;
  line.delay_ns += 0.1;
  line.travel_ns -= 0.3;
  const JointLikelihood::Moments moments = likelihood.moments_near(0, line, 0.6);
  EXPECT_EQ(moments.photons, likelihood.count_near(0, line, -0.6, 0.6));
  const double expected = 0.01 * scene.exposure().amplitude * 1.14;
  EXPECT_NEAR(moments.photons, expected, 0.2 * expected);
  // The target's photons are 0.1 ns before that line, and travel 0.3 ns more.
  EXPECT_NEAR(moments.o / moments.photons, -0.1, 0.03);
  EXPECT_NEAR(moments.os / moments.photons, 0.3 / 12, 0.01);
  EXPECT_NEAR(moments.oo / moments.photons, 0.02 + 0.09 / 12, 0.015);
}

// A place that is taken to beat another is climbed to as any other; one that cannot is given up,
// with what a parabola promises there.
TEST(JointFit, GivesUpWhatCannotBeatAnotherMaximum) {
  SomeTargets scene({20, 50});
  JointFit fit(*scene.shape, scene.train, scene.folded.size());
  const Exposure exposure(scene.folded, scene.train);
  fit.begin(scene.folded, exposure);
  JointParameters start = scene.truth;
  start.targets.at(1).line.delay_ns += 0.05;
  const JointMaximum top = fit.climb(scene.folded, exposure, start, true);
  ASSERT_TRUE(top.has_covariance);
  const JointMaximum beats = fit.climb(scene.folded, exposure, start, true, top.gain_nats - 1);
  EXPECT_EQ(beats.gain_nats, top.gain_nats);
  EXPECT_EQ(beats.covariance, top.covariance);
  const JointMaximum beaten = fit.climb(scene.folded, exposure, start, true, 2 * top.gain_nats);
  EXPECT_EQ(beaten.stop, Stop::beaten);
  EXPECT_FALSE(beaten.has_covariance);
  EXPECT_NEAR(beaten.gain_nats, top.gain_nats, 0.2 * top.gain_nats);
  EXPECT_NE(beaten.gain_nats, top.gain_nats);
}

}  // namespace
}  // namespace splid
