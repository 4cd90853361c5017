#include "estimator/paper/paper_method.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/frame_estimator.hpp"
#include "protocol/pattern_make.hpp"
#include "tests/estimator/paper/paper_scene.hpp"

namespace splid::paper {
namespace {

const std::vector<double> subperiods_ps = {180000, 189000};
const std::vector<double> rates_ps = {90000, 99000};

Pattern two_rates() { return make_mrr(rates_ps, std::vector<std::int64_t>{2777, 2525}); }

// Each has 40 pulses in 3780 ns, or about so.
std::vector<Pattern> patterns_of_every_mode() {
  return {make_periodic(Mode::ambiguous, 3780000, 40), make_periodic(Mode::baseline, 94500),
          make_interleaved(subperiods_ps), make_random({}), two_rates()};
}

PaperResult estimate(const test::FrameMaker& made, const test::FrameMaker::Frame& frame,
                     const SceneOptions& scene = {}) {
  const auto shape = make_gaussian(made.sigma_ns);
  PaperMethod method(made.pattern, *shape, scene);
  return method.estimate(frame.view());
}

// Two searches and two optimisers, one maximum.
TEST(PaperMethod, AgreesWithTheGlobalSearchWhereBothFindTheTarget) {
  for (const Pattern& pattern : patterns_of_every_mode()) {
    for (const double velocity : {0.0, 77.0, -140.0}) {
      test::FrameMaker made = test::simulated_scene(pattern, velocity);
      made.drift_ppm = 80;
      made.start_ps = 340000000000000000;
      const auto frame = made.make(7);
      const PaperResult paper = estimate(made, frame);
      FrameEstimator estimator(pattern, {}, {.max_speed_mps = 300}, {}, made.length_ms, 10000);
      const Estimate search = estimator.estimate(frame.view());
      ASSERT_TRUE(paper.found);
      ASSERT_TRUE(search.has_values);
      const double circle_ns = pattern.unambiguous_delay_ps * 1e-3 * 1.00008;
      const double std_ns = search.std_delay_ns;
      EXPECT_NEAR(std::remainder(paper.delay_ns - search.delay_ns, circle_ns), 0, 0.01 * std_ns);
      EXPECT_NEAR(std::remainder(paper.delay_start_ns - search.delay_start_ns, circle_ns), 0,
                  0.01 * std_ns);
      EXPECT_NEAR(paper.velocity_mps, search.velocity_mps, 0.01 * search.std_velocity_mps);
      EXPECT_NEAR(paper.signal_per_pulse, search.signal_per_pulse,
                  0.01 * search.std_signal_per_pulse);
      EXPECT_NEAR(paper.background_per_ns, search.background_per_ns,
                  0.01 * search.std_background_per_ns);
      EXPECT_NEAR(paper.gain_nats, search.significance_nats, 1e-3);
    }
  }
}

// [P]'s experiment: 50 ms frames of a tenth of the signal.
TEST(PaperMethod, FindsATargetInTheExperimentsFrames) {
  for (const Pattern& pattern : patterns_of_every_mode()) {
    test::FrameMaker made;
    made.pattern = pattern;
    made.velocity_mps = pattern.mode == Mode::random ? 0 : -140;
    const PaperResult paper = estimate(made, made.make(1));
    ASSERT_TRUE(paper.found);
    const double circle_ns = pattern.unambiguous_delay_ps * 1e-3;
    const double truth_ns = 2 * made.distance_m / speed_of_light_mps * 1e9;
    EXPECT_NEAR(std::remainder(paper.delay_ns - truth_ns, circle_ns), 0, 0.02);
    EXPECT_NEAR(paper.velocity_mps, made.velocity_mps, 0.2);
  }
}

// Why splid searches: the random mode starts at rest, 17 pulse widths from where the target is.
TEST(PaperMethod, LosesARandomPatternsMovingTargetInLongFrames) {
  test::FrameMaker made;
  made.pattern = make_random({});
  made.velocity_mps = 50;
  const PaperResult paper = estimate(made, made.make(1));
  EXPECT_EQ(paper.start.velocity_mps, 0);
  EXPECT_GT(std::abs(paper.velocity_mps - made.velocity_mps), 10);
}

TEST(PaperMethod, ReportsDelaysWithinTheUnambiguousOne) {
  for (const Pattern& pattern : patterns_of_every_mode()) {
    for (const double distance_m : {0.0, -0.02, 566.61}) {
      test::FrameMaker made = test::simulated_scene(pattern, 0);
      made.distance_m = distance_m;
      const PaperResult paper = estimate(made, made.make(1));
      const double circle_ns = pattern.unambiguous_delay_ps * 1e-3;
      ASSERT_TRUE(paper.found);
      for (const double delay_ns : {paper.delay_ns, paper.delay_start_ns}) {
        EXPECT_GE(delay_ns, 0);
        EXPECT_LT(delay_ns, circle_ns);
        EXPECT_NEAR(std::remainder(delay_ns - 2 * distance_m / speed_of_light_mps * 1e9, circle_ns),
                    0, 0.12);
      }
    }
  }
}

TEST(PaperMethod, AStaticSceneHasNoVelocity) {
  test::FrameMaker made = test::simulated_scene(make_interleaved(subperiods_ps), 0);
  const PaperResult paper = estimate(made, made.make(1), {.motion = Motion::static_target});
  ASSERT_TRUE(paper.found);
  EXPECT_EQ(paper.velocity_mps, 0);
  EXPECT_NEAR(paper.delay_ns, 2 * made.distance_m / speed_of_light_mps * 1e9, 0.05);
}

void expect_finite(const PaperResult& result) {
  for (const double value : {result.delay_start_ns, result.delay_ns, result.velocity_mps,
                             result.signal_per_pulse, result.background_per_ns, result.gain_nats,
                             result.start.delay_ns, result.start.velocity_mps}) {
    EXPECT_TRUE(std::isfinite(value));
  }
}

TEST(PaperMethod, FramesThatTellNothingAreNotFound) {
  for (const Pattern& pattern : patterns_of_every_mode()) {
    const test::FrameMaker made = test::simulated_scene(pattern, 0);
    test::FrameMaker::Frame frame;
    frame.start_ps = 0;
    frame.end_ps = 500'000'000;
    frame.sync = {.locked = true, .origin_ps = 0, .period_ps = pattern_period_ps(pattern)};
    const std::vector<std::vector<std::int64_t>> few = {{},
                                                        {1000},
                                                        {1000, 400'000'000},
                                                        std::vector<std::int64_t>(5, 123'456'789),
                                                        std::vector<std::int64_t>(1000, 0)};
    for (const auto& photons_ps : few) {
      frame.photons_ps = photons_ps;
      const PaperResult result = estimate(made, frame);
      EXPECT_FALSE(result.found) << photons_ps.size();
      expect_finite(result);
    }
    // A few at any times, in pairs, and all but one at one time: found or not, but finite.
    for (const auto& photons_ps :
         std::vector<std::vector<std::int64_t>>{{0, 1, 499'999'999},
                                                {5, 5, 5, 400'000'000},
                                                {1, 100'000'000, 200'000'000, 300'000'000}}) {
      frame.photons_ps = photons_ps;
      expect_finite(estimate(made, frame));
    }
    frame.photons_ps = {1000, 3000, 400'000'000, 450'000'000};
    frame.losses = {{0, 500'000'000, 0}};
    EXPECT_FALSE(estimate(made, frame).found);
    frame.losses.clear();
    frame.sync.locked = false;
    EXPECT_FALSE(estimate(made, frame).found);
  }
}

TEST(PaperMethod, BackgroundAloneAndSignalAloneAreFinite) {
  for (const Pattern& pattern : patterns_of_every_mode()) {
    test::FrameMaker made = test::simulated_scene(pattern, 20);
    made.signal_per_pulse = 0;
    const PaperResult noise = estimate(made, made.make(1));
    expect_finite(noise);
    EXPECT_LT(noise.gain_nats, 30);
    made.background_per_ns = 0;
    made.signal_per_pulse = 0.018;
    const PaperResult dark = estimate(made, made.make(1));
    expect_finite(dark);
    EXPECT_TRUE(dark.found);
    const double truth_ns = 2 * made.distance_m / speed_of_light_mps * 1e9;
    EXPECT_NEAR(std::remainder(dark.delay_ns - truth_ns, pattern.unambiguous_delay_ps * 1e-3), 0,
                0.06);
  }
}

// Pulses wider than the trains are apart: nothing stands out, and nothing breaks.
TEST(PaperMethod, PulsesThatFillThePeriodAreNotFound) {
  test::FrameMaker made = test::simulated_scene(make_periodic(Mode::ambiguous, 3780000, 40), 0);
  made.sigma_ns = 50;
  const PaperResult result = estimate(made, made.make(1));
  EXPECT_FALSE(result.found);
  expect_finite(result);
}

}  // namespace
}  // namespace splid::paper
