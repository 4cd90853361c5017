#include "estimator/fit/refinement.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

struct RefinementScene {
  test::FrameMaker made;
  test::FrameMaker::Frame frame;
  PulseTrain train;
  FoldedFrame folded;
  std::unique_ptr<PulseShape> shape = make_gaussian(0.1);
  DelayLine truth;

  static test::FrameMaker maker(double velocity_mps) {
    test::FrameMaker made;
    made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
    made.velocity_mps = velocity_mps;
    made.length_ms = 10;
    made.signal_per_pulse = 4e-3;
    return made;
  }
  explicit RefinementScene(double velocity_mps, std::uint64_t seed = 1)
      : made(maker(velocity_mps)),
        frame(made.make(seed)),
        train(made.pattern),
        folded(train, frame.photons_ps.size()) {
    folded.fold(frame.view(), train);
    const double beta = velocity_mps / 299792458.0;
    truth = {2 * made.distance_m / 0.299792458 / (1 + beta),
             2 * beta / (1 + beta) * folded.length_ns};
  }
};

// 6,000 photons near the line: put together on the way, and each by itself at the end, unless only
// a rough place is asked for.
TEST(Refinement, BrightClimbsEndWithEachPhotonByItself) {
  test::FrameMaker bright = RefinementScene::maker(40);
  bright.signal_per_pulse = 0.055;
  const auto photons = bright.make(3);
  const PulseTrain train(bright.pattern);
  FoldedFrame folded(train, photons.photons_ps.size());
  folded.fold(photons.view(), train);
  const auto shape = make_gaussian(0.1);
  Refinement refinement(*shape, train, folded.size());
  const DelayLine start = {RefinementScene(40).truth.delay_ns + 0.1,
                           RefinementScene(40).truth.travel_ns};
  const Fit fit = refinement.climb(folded, start, true);
  EXPECT_NEAR(refinement.judge(folded, fit.parameters, true).gain_nats, fit.gain_nats, 1e-6);
  const Fit rough =
      refinement.climb(folded, start, true, -std::numeric_limits<double>::infinity(), true);
  const DelayLine& a = fit.parameters.line;
  const DelayLine& b = rough.parameters.line;
  EXPECT_NE(a.delay_ns, b.delay_ns);
  EXPECT_NEAR(a.delay_ns, b.delay_ns, 0.01 * std::sqrt(fit.covariance(0, 0)));
  EXPECT_NEAR(a.travel_ns, b.travel_ns, 0.05 * std::sqrt(fit.covariance(1, 1)));
}

// Light of two pulses 4 widths apart is not climbed to the top of one, wherever the climb begins.
// That of one pulse is, with the same bits. The covariance is that of the light's mean line, which
// follows from what the two pulses are.
TEST(Refinement, LightOfSeveralIsNotClimbedToTheTopOfOne) {
  constexpr auto no_rival = -std::numeric_limits<double>::infinity();
  for (const double off_ns : {0.0, 0.4}) {
    const RefinementScene one(40);
    test::FrameMaker other = one.made;
    other.distance_m += off_ns * 0.299792458 / 2;
    const auto photons = one.made.make_with({other}, 7);
    FoldedFrame folded(one.train, photons.photons_ps.size());
    folded.fold(photons.view(), one.train);
    const Exposure exposure(folded, one.train);
    Refinement refinement(*one.shape, one.train, folded.size());
    for (const double start_ns : {-0.1, 0.0, 0.2}) {
      const DelayLine start = {one.truth.delay_ns + start_ns, one.truth.travel_ns + 0.05};
      const Fit top = refinement.climb(folded, start, true);
      const Fit fit =
          refinement.climb(folded, start, true, no_rival, false, Refinement::Until::top_of_one);
      ASSERT_TRUE(fit.has_covariance);
      if (off_ns == 0) {
        EXPECT_EQ(fit.parameters.line.delay_ns, top.parameters.line.delay_ns);
        EXPECT_EQ(fit.gain_nats, top.gain_nats);
        continue;
      }
      EXPECT_EQ(fit.stop, Stop::spread);
      EXPECT_EQ(fit.parameters.line.delay_ns, start.delay_ns);
      EXPECT_LT(fit.gain_nats, top.gain_nats);
      // Two pulses of the width 0.1 ns at +-0.2 ns have a mean square of 0.05 ns^2.
      const double light = 2 * 4e-3 * exposure.amplitude;
      EXPECT_NEAR(fit.covariance(0, 0), 0.05 / light, 0.2 * 0.05 / light);
      EXPECT_NEAR(fit.covariance(1, 1), 12 * fit.covariance(0, 0), 1e-12);
      EXPECT_NEAR(std::sqrt(fit.covariance(2, 2)), std::sqrt(light) / exposure.amplitude,
                  0.1 * std::sqrt(light) / exposure.amplitude);
    }
  }
}

TEST(Refinement, ATargetAtRestKeepsItsTravel) {
  RefinementScene scene(0);
  Refinement refinement(*scene.shape, scene.train, scene.folded.size());
  const Fit fit = refinement.climb(scene.folded, {scene.truth.delay_ns - 0.2, 0}, false);
  EXPECT_EQ(fit.parameters.line.travel_ns, 0);
  EXPECT_EQ(fit.covariance(travel_index, travel_index), 0);
  ASSERT_TRUE(fit.has_covariance);
  const double off = fit.parameters.line.delay_ns - scene.truth.delay_ns;
  EXPECT_LT(std::abs(off), 4 * std::sqrt(fit.covariance(0, 0)));
}

TEST(Refinement, FarFromAnyTargetItStaysFinite) {
  RefinementScene scene(0);
  Refinement refinement(*scene.shape, scene.train, scene.folded.size());
  for (double delay = 5; delay < 3780; delay += 377) {
    const Fit fit = refinement.climb(scene.folded, {delay, 3}, true);
    EXPECT_TRUE(std::isfinite(fit.gain_nats));
    EXPECT_GE(fit.gain_nats, -likelihood::Maximizer::exact_nats);
    EXPECT_TRUE(std::isfinite(fit.parameters.line.delay_ns));
  }
}

TEST(Refinement, RatesOfAMaximumsLineAreTheMaximums) {
  const RefinementScene scene(40);
  Refinement refinement(*scene.shape, scene.train, scene.folded.size());
  const Fit fit = refinement.climb(scene.folded, scene.truth, true);
  const DelayLine line = fit.parameters.line;
  const Fit rates = refinement.fit_rates(scene.folded, line, true);
  EXPECT_EQ(rates.parameters.line.delay_ns, line.delay_ns);
  EXPECT_NEAR(rates.gain_nats, fit.gain_nats, 1e-9);
  EXPECT_NEAR(rates.parameters.signal_per_pulse, fit.parameters.signal_per_pulse, 1e-10);
  EXPECT_TRUE(rates.covariance.isApprox(fit.covariance, 1e-6));
}

// A line that crosses the target's path at mid-frame has its light in the frame's middle.
TEST(Refinement, KnowsLightThatComesFromAPartOfTheFrame) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const RefinementScene scene(30, seed);
    Refinement refinement(*scene.shape, scene.train, scene.folded.size());
    Fit fit = refinement.climb(scene.folded, scene.truth, true);
    EXPECT_TRUE(refinement.is_all_along(fit, {})) << seed;
    DelayLine crossing = scene.truth;
    crossing.travel_ns += 2;
    fit = refinement.fit_rates(scene.folded, crossing, true);
    EXPECT_FALSE(refinement.is_all_along(fit, {})) << seed;
    // In the first half another one is close to it.
    const DelayLine close = {crossing.delay_ns + 0.5, crossing.travel_ns + 2};
    EXPECT_TRUE(refinement.is_all_along(fit, {&close, 1})) << seed;
    // A frame of which a half was not seen would have light in a part too.
    FoldedFrame half = scene.folded;
    half.seen_ns /= 2;
    fit = refinement.fit_rates(half, crossing, true);
    EXPECT_TRUE(refinement.is_all_along(fit, {})) << seed;
  }
}

}  // namespace
}  // namespace splid
