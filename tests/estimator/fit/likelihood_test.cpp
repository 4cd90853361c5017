#include "estimator/fit/likelihood.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "estimator/fit/bound.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

test::FrameMaker likelihood_maker(double amplitude_step = 0) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  double amplitude = 1;
  for (double& a : made.pattern.segments.front().amplitudes) a = amplitude += amplitude_step;
  made.length_ms = 2;
  made.velocity_mps = 31;
  made.signal_per_pulse = 0.01;
  return made;
}

// Everything that an evaluation needs, about the line of the truth.
struct LikelihoodScene {
  test::FrameMaker made;
  test::FrameMaker::Frame frame;
  PulseTrain train;
  FoldedFrame folded;
  std::unique_ptr<PulseShape> shape;
  NearSet near;
  Likelihood likelihood;
  DelayLine truth;

  explicit LikelihoodScene(const test::FrameMaker& made_in)
      : made(made_in),
        frame(made.make(11)),
        train(made.pattern),
        folded(train, frame.photons_ps.size()),
        shape(make_gaussian(made.sigma_ns)),
        near(frame.photons_ps.size(), 40 * frame.photons_ps.size()),
        likelihood(*shape, 40 * frame.photons_ps.size()) {
    folded.fold(frame.view(), train);
    const double beta = made.velocity_mps / 299792458.0;
    truth = {2 * made.distance_m / 0.299792458 / (1 + beta) / folded.scale,
             2 * beta / (1 + beta) * folded.length_ns};
    const double reach = 12 * made.sigma_ns;
    near.collect(folded, comb_windows(train, -reach, reach), train, truth);
  }
  [[nodiscard]] Exposure exposure() const { return {folded, train}; }
};

// The sum of [P] Eq. 2 over every pulse whose light may matter, and Eq. 4 with its logarithm: two
// plain loops in long double, from tau and v, not from the line.
long double brute_force(const LikelihoodScene& scene, long double tau_mid_ns, long double v_mps,
                        long double S, long double b) {
  const long double beta = v_mps / 299792458.0L;
  const auto& segment = scene.made.pattern.segments.front();
  const long double period = static_cast<long double>(scene.frame.sync.period_ps) * 1e-3L;
  const long double sigma = scene.made.sigma_ns;
  const std::int64_t mid_ps =
      scene.frame.start_ps + (scene.frame.end_ps - scene.frame.start_ps) / 2;
  const long double start = static_cast<long double>(scene.frame.start_ps - mid_ps) * 1e-3L;
  const long double length =
      static_cast<long double>(scene.frame.end_ps - scene.frame.start_ps) * 1e-3L;
  long double value = 0;
  for (const std::int64_t photon : scene.frame.photons_ps) {
    const long double t = static_cast<long double>(photon - mid_ps) * 1e-3L;
    long double density = 0;
    const auto k = static_cast<std::int64_t>(std::floor((t - tau_mid_ns - start) / period));
    for (std::int64_t turn = k - 1; turn <= k + 1; ++turn) {
      for (std::size_t p = 0; p < segment.pulse_times_ps.size(); ++p) {
        const long double e =
            start + turn * period + segment.pulse_times_ps[p] * period / segment.period_ps;
        const long double x = (t - tau_mid_ns / (1 - beta) - e * (1 + beta) / (1 - beta)) / sigma;
        density += segment.amplitudes[p] * std::exp(-x * x / 2) /
                   (sigma * std::sqrt(2 * std::numbers::pi_v<long double>));
      }
    }
    value += std::log(b + S * density);
  }
  long double amplitude = 0;
  for (const double a : segment.amplitudes) amplitude += a;
  return value - b * length - S * amplitude * length / period * (1 - beta) / (1 + beta);
}

void expect_brute_force(const LikelihoodScene& scene_in, double S, double b, double delay_off_ns,
                        double velocity_mps) {
  auto& scene = const_cast<LikelihoodScene&>(scene_in);
  const double beta = velocity_mps / 299792458.0;
  const double tau = 2 * scene.made.distance_m / 0.299792458 + delay_off_ns;
  // A line is in the pattern's own clock.
  const DelayLine line = {tau / (1 + beta) / scene.folded.scale,
                          2 * beta / (1 + beta) * scene.folded.length_ns};
  const double value = scene.likelihood.evaluate(scene.near, scene.exposure(), {line, S, b}).value;
  const auto expected = static_cast<double>(brute_force(scene, tau, velocity_mps, S, b));
  EXPECT_NEAR(value, expected, 1e-9 * std::abs(expected)) << S << " " << b << " " << velocity_mps;
}

TEST(Likelihood, AgreesWithALongDoubleDoubleLoop) {
  const LikelihoodScene even(likelihood_maker());
  expect_brute_force(even, 0.01, 1.75e-4, 0, 31);
  expect_brute_force(even, 0.01, 1.75e-4, 0.07, 30.4);
  expect_brute_force(even, 3, 1e-1, -0.05, 31.2);
  expect_brute_force(even, 1e-9, 1e-9, 0.02, 31);
  const LikelihoodScene uneven(likelihood_maker(0.3));
  expect_brute_force(uneven, 0.01, 1.75e-4, 0.01, 31);
  test::FrameMaker drifting = likelihood_maker();
  drifting.drift_ppm = 100;
  drifting.start_ps = 340000000000000000;
  expect_brute_force(LikelihoodScene(drifting), 0.01, 1.75e-4, 0.01, 31);
  test::FrameMaker wide = likelihood_maker();
  wide.sigma_ns = 5;  // pulses are 9 ns apart
  wide.length_ms = 0.5;
  expect_brute_force(LikelihoodScene(wide), 0.01, 1.75e-4, 0.3, 31);
}

TEST(Likelihood, GradientAndHessianAgreeWithDifferences) {
  for (const double sigma_ns : {0.1, 5.0}) {
    test::FrameMaker made = likelihood_maker(0.1);
    made.sigma_ns = sigma_ns;
    made.length_ms = 0.5;
    LikelihoodScene scene(made);
    const FrameParameters at = {
        {scene.truth.delay_ns + 0.3 * sigma_ns, scene.truth.travel_ns - 0.7 * sigma_ns},
        0.004,
        3e-4};
    const auto shifted = [&](int index, double by) {
      FrameParameters p = at;
      (index == 0   ? p.line.delay_ns
       : index == 1 ? p.line.travel_ns
       : index == 2 ? p.signal_per_pulse
                    : p.background_per_ns) += by;
      return scene.likelihood.evaluate(scene.near, scene.exposure(), p);
    };
    const LikelihoodPoint point = shifted(0, 0);
    const double steps[] = {1e-4 * sigma_ns, 1e-4 * sigma_ns, 1e-7, 1e-8};
    for (int i = 0; i < 4; ++i) {
      const LikelihoodPoint up = shifted(i, steps[i]);
      const LikelihoodPoint down = shifted(i, -steps[i]);
      const double slope = (up.value - down.value) / (2 * steps[i]);
      EXPECT_NEAR(point.gradient[i], slope, 1e-5 * std::abs(slope) + 1e-3) << i;
      for (int j = 0; j < 4; ++j) {
        const double second = (up.gradient[j] - down.gradient[j]) / (2 * steps[i]);
        const double scale = std::sqrt(std::abs(point.hessian(i, i) * point.hessian(j, j)));
        EXPECT_NEAR(point.hessian(i, j), second, 1e-5 * scale) << i << j;
      }
    }
  }
}

// (1 - beta) / (1 + beta) in doubles would show no change here at all.
TEST(Likelihood, FeelsTenNanometresASecond) {
  LikelihoodScene scene(likelihood_maker());
  const double per_mps = 2 / 299792458.0 * scene.folded.length_ns;
  FrameParameters at = {scene.truth, 0.01, 1.75e-4};
  at.line.travel_ns = 0;
  scene.near.collect(scene.folded, comb_windows(scene.train, -2, 2), scene.train, at.line);
  const LikelihoodPoint point = scene.likelihood.evaluate(scene.near, scene.exposure(), at);
  at.line.travel_ns = 1e-8 * per_mps;
  const LikelihoodPoint moved = scene.likelihood.evaluate(scene.near, scene.exposure(), at);
  const double change = point.hessian(travel_index, travel_index) * at.line.travel_ns;
  EXPECT_NEAR((moved.gradient - point.gradient)[travel_index] / change, 1, 0.1);
}

TEST(Likelihood, ProfileIsTheMaximumOverSignalAndBackground) {
  LikelihoodScene scene(likelihood_maker());
  const auto profile = scene.likelihood.profile(scene.near, scene.exposure(), scene.truth);
  const LikelihoodPoint point =
      scene.likelihood.evaluate(scene.near, scene.exposure(), profile.parameters);
  EXPECT_NEAR(point.value, profile.value, 1e-9 * std::abs(profile.value));
  EXPECT_NEAR(point.gradient[signal_index] * profile.parameters.signal_per_pulse, 0, 1e-6);
  EXPECT_NEAR(point.gradient[background_index] * profile.parameters.background_per_ns, 0, 1e-6);
  // The gain is over a flat frame of the same count.
  const double n = static_cast<double>(scene.folded.size());
  EXPECT_NEAR(profile.gain_nats, profile.value - (n * std::log(n / scene.folded.seen_ns) - n),
              1e-6);
  EXPECT_NEAR(profile.parameters.signal_per_pulse, 0.01, 0.002);
}

TEST(Likelihood, ProfileOfNothingAndOfSignalAloneIsFinite) {
  test::FrameMaker dark = likelihood_maker();
  dark.background_per_ns = 0;
  dark.length_ms = 0.2;
  LikelihoodScene scene(dark);
  const auto profile = scene.likelihood.profile(scene.near, scene.exposure(), scene.truth);
  EXPECT_TRUE(std::isfinite(profile.gain_nats));
  EXPECT_LT(profile.parameters.background_per_ns * scene.folded.seen_ns, 1e-6);
  scene.near.collect(scene.folded, comb_windows(scene.train, -0.5, 0.5), scene.train, {900.3, 0});
  const auto nothing = scene.likelihood.profile(scene.near, scene.exposure(), {900.3, 0});
  EXPECT_NEAR(nothing.gain_nats, 0, 1e-3);
}

// The information that frames show is on average the information that the bound expects.
TEST(Likelihood, ObservedInformationAveragesToTheExpected) {
  test::FrameMaker made = likelihood_maker();
  made.velocity_mps = 0;
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  Eigen::Matrix4d expected = Eigen::Matrix4d::Zero();
  const int frames = 60;
  const auto shape = make_gaussian(made.sigma_ns);
  for (int n = 0; n < frames; ++n) {
    const auto frame = made.make(100 + static_cast<std::uint64_t>(n));
    const PulseTrain train(made.pattern);
    FoldedFrame folded(train, frame.photons_ps.size());
    folded.fold(frame.view(), train);
    NearSet near(folded.size(), folded.size());
    const DelayLine line = {2 * made.distance_m / 0.299792458, 0};
    near.collect(folded, comb_windows(train, -1.5, 1.5), train, line);
    Likelihood likelihood(*shape, folded.size());
    const FrameParameters truth = {line, made.signal_per_pulse, made.background_per_ns};
    sum -= likelihood.evaluate(near, {folded, train}, truth).hessian;
    expected += fisher_information(*shape, train, {folded, train}, truth);
  }
  // 60 frames of 211 signal photons: the mean curvature scatters by about 1.5 %.
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(sum(i, i) / expected(i, i), 1, 0.06) << i;
    for (int j = 0; j < i; ++j) {
      const double scale = std::sqrt(expected(i, i) * expected(j, j));
      EXPECT_NEAR(sum(i, j) / scale, expected(i, j) / scale, 0.05) << i << j;
    }
  }
}

}  // namespace
}  // namespace splid
