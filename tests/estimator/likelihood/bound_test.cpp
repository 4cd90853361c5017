#include "estimator/likelihood/bound.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>

#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

Exposure exposure_of(const test::FrameMaker& made) {
  const auto frame = made.make(1);
  const PulseTrain train(made.pattern);
  FoldedFrame folded(train, frame.photons_ps.size());
  folded.fold(frame.view(), train);
  return {folded, train};
}

// Of a target at rest, about its delay, walk, signal and the background.
Eigen::Matrix4d information(const PulseShape& shape, const PulseTrain& train,
                            const Exposure& exposure, double delay_ns, double S, double b,
                            const DeadDetector& detector = {}) {
  likelihood::Model at;
  at.add({{delay_ns, 0}, S});
  at.background_per_ns = b;
  const SmallMatrix all = expected_information(shape, train, exposure, at, detector);
  constexpr std::array<Eigen::Index, 4> places = {
      likelihood::delay, likelihood::walk, likelihood::signal, likelihood::background_place(1)};
  Eigen::Matrix4d J;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      J(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          all(places.at(i), places.at(j));
    }
  }
  return J;
}

TEST(Bound, WithoutBackgroundEverySignalPhotonCounts) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  const PulseTrain train(made.pattern);
  const Exposure exposure = exposure_of(made);
  const double S = 13.5e-4;
  const auto shape = make_gaussian(0.1);
  const Eigen::Matrix4d J = information(*shape, train, exposure, 1898, S, 1e-15);
  const double photons = S * exposure.amplitude;
  EXPECT_NEAR(J(0, 0) / (photons / 0.01), 1, 1e-6);
  EXPECT_NEAR(J(1, 1) / (photons / 0.12), 1, 1e-6);
  EXPECT_NEAR(J(2, 2) / (exposure.amplitude / S), 1, 1e-6);
}

// The figures of the design for [P]'s experiment: 0.62 mm at mid-frame and 4.3 cm/s.
TEST(Bound, OfTheExperimentIsAsPublished) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  const PulseTrain train(made.pattern);
  const Exposure exposure = exposure_of(made);
  const auto shape = make_gaussian(0.1);
  const Eigen::Matrix4d bound =
      information(*shape, train, exposure, 1898, 13.5e-4, 1.75e-4).inverse();
  const double mm = 1e3 * std::sqrt(bound(0, 0)) * 0.299792458 / 2;
  const double cm_per_s = 100 * std::sqrt(bound(1, 1)) / 5e7 * 299792458.0 / 2;
  EXPECT_NEAR(mm, 0.62, 0.02);
  EXPECT_NEAR(cm_per_s, 4.3, 0.1);
}

// Of light that is even over the frame the curvature has 180 times the variance of the mean delay,
// and the delay at mid-frame is a twelfth of it below the mean: 1 + 180 / 144 = 9 / 4 of the
// variance.
TEST(Bound, AnUnknownAccelerationWidensTheDelayByAHalf) {
  const Pattern pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  const auto shape = make_gaussian(0.1);
  BoundScene scene = {50e6, 50e6, 1898, 30, 13.5e-4, 1.75e-4};
  const Bound straight = cramer_rao_bound(pattern, *shape, scene);
  scene.accelerating = true;
  const Bound curved = cramer_rao_bound(pattern, *shape, scene);
  EXPECT_EQ(straight.acceleration_mps2, 0);
  EXPECT_NEAR(curved.delay_ns / straight.delay_ns, 1.5, 1e-6);
  EXPECT_NEAR(curved.velocity_mps / straight.velocity_mps, 1, 1e-9);
  EXPECT_NEAR(curved.acceleration_mps2,
              std::sqrt(180.0) * straight.delay_ns * 299792458.0 * 1e9 / (50e6 * 50e6), 1e-4);
}

// Trapezoids over the whole period in long double, with every pulse everywhere.
TEST(Bound, AgreesWithAPlainIntegralWherePulsesOverlap) {
  test::FrameMaker made;
  made.pattern = test::random_pattern(200000, 5, 9000, 3);
  made.pattern.segments.front().amplitudes = {1, 0.2, 3, 1, 0.01};
  made.length_ms = 1;
  const PulseTrain train(made.pattern);
  const Exposure exposure = exposure_of(made);
  const double sigma = 5, S = 0.1, b = 1e-3;
  const Eigen::Matrix4d J = information(*make_gaussian(sigma), train, exposure, 50, S, b);
  const int steps = 200000;
  long double dd = 0, ss = 0, bb = 0, ds = 0;
  for (int n = 0; n < steps; ++n) {
    const Comb& comb = train.segments.front().comb;
    const long double x = comb.period_ns * n / steps;
    long double h = 0, d1 = 0;
    for (int turn = -2; turn <= 2; ++turn) {
      for (std::size_t p = 0; p < comb.times_ns.size(); ++p) {
        const long double u = (x - comb.times_ns[p] - turn * comb.period_ns) / sigma;
        const long double g =
            comb.amplitudes[p] * std::exp(-u * u / 2) / (sigma * std::sqrt(2 * M_PIl));
        h += g;
        d1 += -u / sigma * g;
      }
    }
    const long double lambda = b + S * h;
    dd += S * S * d1 * d1 / lambda;
    ss += h * h / lambda;
    bb += 1 / lambda;
    ds += -S * d1 * h / lambda;
  }
  const long double weight = static_cast<long double>(exposure.seen_ns) / steps;
  EXPECT_NEAR(J(0, 0) / static_cast<double>(dd * weight), 1, 1e-6);
  EXPECT_NEAR(J(2, 2) / static_cast<double>(ss * weight), 1, 1e-6);
  EXPECT_NEAR(J(3, 3) / static_cast<double>(bb * weight), 1, 1e-6);
  EXPECT_NEAR(J(0, 2), static_cast<double>(ds * weight), 1e-6 * std::sqrt(J(0, 0) * J(2, 2)));
}

// A steady light b leaves a detector alive for 1 / (1 + b t_d) of the time.
TEST(Bound, OfADetectorWithDeadTimeCountsTheLiveTime) {
  test::FrameMaker made;
  made.pattern = test::periodic_pattern(100000);
  made.length_ms = 1;
  const PulseTrain train(made.pattern);
  const double b = 0.06;
  const Eigen::Matrix4d J =
      information(*make_gaussian(0.1), train, exposure_of(made), 50, 1e-9, b, {.dead_time_ns = 50});
  EXPECT_NEAR(J(3, 3), 1e6 / (1 + b * 50) / b, 1e-3 * J(3, 3));
  // Of three detectors each sees a third of the light.
  const Eigen::Matrix4d split = information(*make_gaussian(0.1), train, exposure_of(made), 50, 1e-9,
                                            b, {.dead_time_ns = 50, .inputs = 3});
  EXPECT_NEAR(split(3, 3), 1e6 / (1 + b * 50 / 3) / b, 1e-3 * split(3, 3));
}

// Pulses 100 ns apart and dead times of 250 ns: a pulse that is seen, with the chance
// q = 1 - exp(-S), hides the next two, so that 1 of 1 + 2 q pulses meets a detector that is alive.
TEST(Bound, ADeadTimeOfSeveralPeriodsHidesPulses) {
  const Pattern pattern = test::periodic_pattern(100000);
  for (const double S : {0.1, 1.0, 3.0}) {
    const Comb comb(pattern.segments.front());
    const CombLight light = {0, S};
    const LiveFraction alive(*make_gaussian(0.1), comb, {&light, 1}, 0, {.dead_time_ns = 250});
    const double q = 1 - std::exp(-S);
    EXPECT_NEAR(alive.at(90), 1 / (1 + 2 * q), 2e-3) << S;
    EXPECT_NEAR(alive.at(10), (1 - q) / (1 + 2 * q), 2e-3) << S;
  }
}

BoundScene bound_scene(double delay_ns, double velocity_mps, double signal) {
  return {5e6, 5e6, delay_ns, velocity_mps, signal, 1.75e-4};
}

void expect_same_bound(const Bound& a, const Bound& b, double within) {
  EXPECT_NEAR(a.delay_ns / b.delay_ns, 1, within);
  EXPECT_NEAR(a.delay_start_ns / b.delay_start_ns, 1, within);
  EXPECT_NEAR(a.velocity_mps / b.velocity_mps, 1, within);
  EXPECT_NEAR(a.signal_per_pulse / b.signal_per_pulse, 1, within);
  EXPECT_NEAR(a.background_per_ns / b.background_per_ns, 1, within);
}

// Far apart, each target is as certain as alone, but for what the other takes of the dark time.
// Half a width apart, each hides the other.
TEST(JointBound, TargetsThatOverlapAreTheLessCertain) {
  const Pattern pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  const auto shape = make_gaussian(0.1);
  const BoundScene alone = bound_scene(1898, 31, 0.01);
  const Bound bound = cramer_rao_bound(pattern, *shape, alone);
  const BoundScene apart[] = {alone, bound_scene(1960.3, -20, 0.002)};
  expect_same_bound(joint_bound(pattern, *shape, apart).front(), bound, 0.02);
  const BoundScene close[] = {alone, bound_scene(1898.05, 31, 0.01)};
  const double worse = joint_bound(pattern, *shape, close).front().delay_ns / bound.delay_ns;
  EXPECT_GT(worse, 5);
  EXPECT_LT(worse, 100);
}

// Of two that overlap, a dead time that hides a fifth of the light hides a fifth of what it tells.
TEST(JointBound, KnowsDeadTimeAndTheWidthOfThePulse) {
  const Pattern pattern = test::periodic_pattern(100000);
  const auto shape = make_gaussian(0.1);
  BoundScene one = {5e6, 5e6, 50, 31, 0.05, 5e-3}, other = {5e6, 5e6, 50.3, 31, 0.05, 5e-3};
  const auto bound = [&] {
    const BoundScene both[] = {one, other};
    return joint_bound(pattern, *shape, both).front();
  };
  const Bound ideal = bound();
  one.detector.dead_time_ns = 50;
  const Bound dead = bound();
  EXPECT_NEAR(dead.delay_ns / ideal.delay_ns, std::sqrt(1 + 50 * 5e-3), 0.03);
  EXPECT_EQ(dead.pulse_sigma_ns, 0);
  one.width_unknown = true;
  EXPECT_GT(bound().pulse_sigma_ns, 0);
  EXPECT_GT(bound().delay_ns, dead.delay_ns);
}

}  // namespace
}  // namespace splid
