#include "estimator/search/refinement.hpp"

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
  DelayTrack truth;

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
  const DelayTrack start = {RefinementScene(40).truth.delay_ns + 0.1,
                            RefinementScene(40).truth.walk_ns};
  const Fit fit = refinement.climb(folded, start, true);
  EXPECT_NEAR(refinement.judge(folded, fit.parameters, true).gain_nats, fit.gain_nats, 1e-6);
  const Fit rough =
      refinement.climb(folded, start, true, -std::numeric_limits<double>::infinity(), true);
  const DelayTrack& a = fit.parameters.line;
  const DelayTrack& b = rough.parameters.line;
  EXPECT_NE(a.delay_ns, b.delay_ns);
  EXPECT_NEAR(a.delay_ns, b.delay_ns, 0.01 * std::sqrt(fit.covariance(0, 0)));
  EXPECT_NEAR(a.walk_ns, b.walk_ns, 0.05 * std::sqrt(fit.covariance(1, 1)));
}

TEST(Refinement, ATargetAtRestKeepsItsTravel) {
  RefinementScene scene(0);
  Refinement refinement(*scene.shape, scene.train, scene.folded.size());
  const Fit fit = refinement.climb(scene.folded, {scene.truth.delay_ns - 0.2, 0}, false);
  EXPECT_EQ(fit.parameters.line.walk_ns, 0);
  EXPECT_EQ(fit.covariance(walk_index, walk_index), 0);
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

}  // namespace
}  // namespace splid
