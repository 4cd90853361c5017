#include "estimator/calibration/rest_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "tests/support/frame_maker.hpp"

namespace splid::calibration {
namespace {

constexpr double mm_per_ps = 299792458.0 / 2 * 1e-9;
constexpr int frames = 128;

// Frames of 2 ms, the target of each where `shift_ps` says at that time, in seconds.
std::vector<test::FrameMaker::Frame> watch(const std::function<double(double)>& shift_ps,
                                           std::uint64_t seed, double signal_per_pulse = 0.1) {
  test::FrameMaker made;
  made.pattern = test::random_pattern(1000000, 12, 9000, 4);
  made.signal_per_pulse = signal_per_pulse;
  made.length_ms = 2;
  std::vector<test::FrameMaker::Frame> all;
  for (int n = 0; n < frames; ++n) {
    made.distance_m = 30 + shift_ps(0.002 * n) * mm_per_ps * 1e-3;
    all.push_back(made.make(1000 * seed + static_cast<std::uint64_t>(n)));
    made.start_ps += 2'000'000'000;
  }
  return all;
}

RestReport report_of(const std::vector<test::FrameMaker::Frame>& watched) {
  PhaseHistogram fold(1000000, 100);
  for (const auto& frame : watched) fold.add(frame.view());
  const auto found = calibrate(fold, 100);
  EXPECT_TRUE(found);
  RestCheck check(fold, *found);
  for (const auto& frame : watched) check.add(frame.view());
  return check.report();
}

std::optional<TargetMotion::Motion> motion_of(const std::vector<test::FrameMaker::Frame>& watched) {
  TargetMotion track(1000000, 100);
  for (const auto& frame : watched) track.add(frame.view());
  return track.motion();
}

double still(double /*time_s*/) { return 0; }

TEST(RestCheck, ATargetAtRestIsAtRest) {
  double squares = 0;
  constexpr int seeds = 8;
  for (int seed = 1; seed <= seeds; ++seed) {
    const auto watched = watch(still, static_cast<std::uint64_t>(seed), 0.02);
    const RestReport rest = report_of(watched);
    EXPECT_EQ(rest.frames, 128U);
    EXPECT_NEAR(rest.seconds, 0.254, 1e-6);
    EXPECT_FALSE(rest.moves());
    EXPECT_LT(rest.wander_deviations, 4);
    // 480 signal photons a frame: 4.6 ps.
    EXPECT_NEAR(rest.std_delay_rate_ps_per_s, 100 / std::sqrt(480.0 * 128) * std::sqrt(12) / 0.256,
                0.4);
    squares += std::pow(rest.delay_rate_ps_per_s / rest.std_delay_rate_ps_per_s, 2) / seeds;
    EXPECT_FALSE(motion_of(watched));
  }
  EXPECT_NEAR(std::sqrt(squares), 1, 0.75);  // 8 values: 25 %, three deviations
}

TEST(RestCheck, AnEvenMotionIsMeasured) {
  const RestReport rest = report_of(watch([](double t) { return -80 * t; }, 3));
  EXPECT_TRUE(rest.moves());
  EXPECT_NEAR(rest.delay_rate_ps_per_s, -80, 4 * rest.std_delay_rate_ps_per_s);
  EXPECT_NEAR(rest.walk_ps(), -80 * rest.seconds, 4);
}

// Fast and slow: one shows from frame to frame, the other in means over many.
TEST(RestCheck, ToAndFroIsWander) {
  for (const double turns_per_s : {130.0, 9.0}) {
    const auto sway = [&](double t) { return 8 * std::sin(2 * M_PI * turns_per_s * t); };
    const RestReport rest = report_of(watch(sway, 4));
    EXPECT_TRUE(rest.wanders()) << turns_per_s;
    EXPECT_NEAR(rest.wander_ps, 8 / std::sqrt(2.0), 1.2) << turns_per_s;
    EXPECT_LT(std::abs(rest.walk_ps()), 5) << turns_per_s;
  }
}

// 2,400 signal photons a frame know it to 2 ps: no frame shows a slow sway of 1.7 ps, means of
// several do.
TEST(RestCheck, ASlowSwayShowsInMeans) {
  const auto sway = [](double t) { return 1.7 * std::sin(2 * M_PI * 5 * t); };
  const RestReport rest = report_of(watch(sway, 4));
  EXPECT_TRUE(rest.wanders());
  EXPECT_NEAR(rest.wander_ps, 1.2, 0.4);
}

TEST(RestCheck, TooFewFramesSayNothing) {
  auto watched = watch(still, 1);
  watched.resize(1);
  const RestReport rest = report_of(watched);
  EXPECT_EQ(rest.frames, 1U);
  EXPECT_FALSE(rest.moves() || rest.wanders());
}

// From a few pulse widths over the whole recording up to as many in a slice, and over the end of
// the period.
TEST(TargetMotion, MeasuresMotionThatSmearsPulses) {
  for (const double ps_per_s : {2500.0, -40'000.0, 400'000.0, 3'000'000.0}) {
    const auto motion = motion_of(watch([&](double t) { return ps_per_s * t; }, 5));
    ASSERT_TRUE(motion) << ps_per_s;
    EXPECT_NEAR(motion->delay_rate_ps_per_s / ps_per_s, 1, 0.1) << ps_per_s;
    EXPECT_NEAR(motion->delay_rate_ps_per_s, ps_per_s, 5 * motion->std_delay_rate_ps_per_s)
        << ps_per_s;
    EXPECT_NEAR(motion->moved_ps, std::abs(ps_per_s) * 0.254,
                0.1 * std::abs(ps_per_s) * 0.254 + 100);
  }
}

TEST(TargetMotion, MeasuresHowFarATargetGoesToAndFro) {
  const auto sway = [](double t) { return 2000 * std::sin(2 * M_PI * 8 * t); };
  const auto motion = motion_of(watch(sway, 6));
  ASSERT_TRUE(motion);
  EXPECT_NEAR(motion->moved_ps, 4000, 400);
}

TEST(TargetMotion, SaysNothingOfBackgroundOrOfTooFewSlices) {
  EXPECT_FALSE(motion_of(watch([](double t) { return 40'000 * t; }, 7, 0)));
  auto watched = watch([](double t) { return 40'000 * t; }, 7);
  watched.resize(2);
  EXPECT_FALSE(motion_of(watched));
}

}  // namespace
}  // namespace splid::calibration
