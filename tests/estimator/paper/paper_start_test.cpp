#include <gtest/gtest.h>

#include <cmath>

#include "estimator/paper/paper_method.hpp"
#include "protocol/pattern_make.hpp"
#include "tests/estimator/paper/paper_scene.hpp"

namespace splid::paper {
namespace {

constexpr double velocities_mps[] = {0, 10, 77, -140};

std::optional<PaperParameters> start_of(const test::PaperScene& scene, double max_speed_mps = 150) {
  SceneOptions options;
  options.max_speed_mps = max_speed_mps;
  if (max_speed_mps == 0) options.motion = Motion::static_target;
  const PaperMethod method(scene.made.pattern, *scene.shape, options);
  PaperResult result = method.estimate(scene.frame.view());
  if (result.stop == Stop::not_run) return std::nullopt;
  result.start.delay_ns /= scene.folded.scale;
  return result.start;
}

// Within what refinement reaches: tau by ten pulse widths at most, and the line's far end too.
void expect_in_reach(const test::PaperScene& scene, const char* mode) {
  const auto start = start_of(scene);
  ASSERT_TRUE(start.has_value()) << mode;
  const double circle_ns = scene.made.pattern.unambiguous_delay_ps * 1e-3;
  const double off_ns = std::remainder(start->delay_ns - scene.delay_start_ns(), circle_ns);
  const double moved_ns =
      (start->velocity_mps - scene.made.velocity_mps) * 2 / 299792458.0 * scene.folded.length_ns;
  EXPECT_LT(std::abs(off_ns), 0.5) << mode << " " << scene.made.velocity_mps;
  EXPECT_LT(std::abs(off_ns + moved_ns), 0.5) << mode << " " << scene.made.velocity_mps;
  EXPECT_NEAR(start->signal_per_pulse / scene.made.signal_per_pulse, 1, 0.4) << mode;
  EXPECT_NEAR(start->background_per_ns / scene.made.background_per_ns, 1, 0.4) << mode;
}

TEST(PaperStart, PeriodicPatternsByFourierAnalysis) {
  for (const double velocity : velocities_mps) {
    expect_in_reach(
        {test::simulated_scene(make_periodic(Mode::ambiguous, 3780000, 40), velocity), 1},
        "ambiguous");
    test::FrameMaker made = test::simulated_scene(make_periodic(Mode::baseline, 3780000), velocity);
    // One pulse with the light of forty, which does not leave at the pattern's start.
    made.signal_per_pulse *= 40;
    made.pattern.segments[0].pulse_times_ps = {1234000};
    expect_in_reach({made, 2}, "baseline");
  }
}

TEST(PaperStart, SeveralRatesByTheRemaindersOfEach) {
  const std::vector<double> periods_ps = {90000, 99000};
  for (const double velocity : velocities_mps) {
    // One stretch of each rate in the frame, and many.
    for (const std::int64_t share : {1, 10}) {
      test::FrameMaker made = test::simulated_scene(
          make_mrr(periods_ps, std::vector<std::int64_t>{2777 / share, 2525 / share}), velocity);
      made.distance_m = 100;
      expect_in_reach({made, 3}, "mrr");
    }
    // Periods whose ratio is no ratio of small integers, with a third.
    test::FrameMaker made =
        test::simulated_scene(make_mrr(std::vector<double>{99900, 104100, 111000},
                                       std::vector<std::int64_t>{1600, 1600, 1600}),
                              velocity);
    expect_in_reach({made, 4}, "mrr of real periods");
  }
}

// [P] Eq. 5: by the second rate's turn, 10 ms on, the target has moved 9 ns, as much as the rates'
// common divisor.
TEST(PaperStart, RemaindersAreTakenBackToTheFramesStart) {
  test::FrameMaker made;
  made.pattern =
      make_mrr(std::vector<double>{90000, 99000}, std::vector<std::int64_t>{111111, 101010});
  made.length_ms = 20;
  made.distance_m = 100;
  for (const double velocity : {140.0, -140.0}) {
    made.velocity_mps = velocity;
    expect_in_reach({made, 1}, "mrr, 20 ms");
  }
}

// The generator's pattern seldom starts with the frame.
TEST(PaperStart, AFrameMayBeginWithinATrain) {
  const Pattern pattern =
      make_mrr(std::vector<double>{90000, 99000}, std::vector<std::int64_t>{2777, 2525});
  test::FrameMaker made = test::simulated_scene(pattern, 77);
  made.length_ms = 1;
  made.distance_m = 100;
  for (const std::int64_t late_ps : {100'000'000, 320'000'000}) {
    test::FrameMaker::Frame frame = made.make(5);
    frame.start_ps += late_ps;
    std::erase_if(frame.photons_ps, [&](std::int64_t t) { return t < frame.start_ps; });
    // What the target is at the middle of the frame that is left.
    test::FrameMaker later = made;
    later.distance_m += made.velocity_mps * static_cast<double>(late_ps) * 1e-12 / 2;
    expect_in_reach({later, frame}, "mrr, late");
  }
}

TEST(PaperStart, InterleavedPatternsByTheLargestCluster) {
  for (const double velocity : velocities_mps) {
    const Pattern pattern = make_interleaved(std::vector<double>{180000, 189000});
    expect_in_reach({test::simulated_scene(pattern, velocity), 1}, "interleaved");
    // The experiment: at 140 m/s the target moves 47 ns, and both trains' clusters are half the
    // period wide.
    test::FrameMaker made;
    made.pattern = pattern;
    made.velocity_mps = velocity;
    expect_in_reach({made, 2}, "interleaved, 50 ms");
  }
}

// A calibrated pattern's times have any origin.
TEST(PaperStart, InterleavedPatternsMayStartAnywhere) {
  test::FrameMaker made =
      test::simulated_scene(make_interleaved(std::vector<double>{180000, 189000}), 30);
  std::vector<double>& times_ps = made.pattern.segments[0].pulse_times_ps;
  for (double& time_ps : times_ps) time_ps = std::fmod(time_ps + 1'500'000, 3'780'000);
  std::sort(times_ps.begin(), times_ps.end());
  expect_in_reach({made, 1}, "interleaved, later");
}

// The matched filter takes the target for one at rest: [P]'s own limit.
TEST(PaperStart, RandomPatternsByAMatchedFilterAtRest) {
  const Pattern pattern = make_random({});
  for (const double velocity : velocities_mps) {
    const test::PaperScene scene(test::simulated_scene(pattern, velocity), 1);
    const auto start = start_of(scene);
    ASSERT_TRUE(start.has_value());
    EXPECT_EQ(start->velocity_mps, 0);
    EXPECT_NEAR(start->delay_ns, scene.delay_start_ns(), 0.5);
  }
  test::FrameMaker made;
  made.pattern = pattern;
  made.velocity_mps = 77;  // 26 ns in 50 ms
  const test::PaperScene scene(made, 2);
  EXPECT_GT(std::abs(start_of(scene)->delay_ns - scene.delay_start_ns()), 0.5);
}

TEST(PaperStart, ATargetAtRestHasNoVelocity) {
  const Pattern pattern = make_interleaved(std::vector<double>{180000, 189000});
  const test::PaperScene scene(test::simulated_scene(pattern, 0), 1);
  const auto start = start_of(scene, 0);
  ASSERT_TRUE(start.has_value());
  EXPECT_EQ(start->velocity_mps, 0);
  EXPECT_NEAR(start->delay_ns, scene.delay_start_ns(), 0.1);
}

}  // namespace
}  // namespace splid::paper
