#include "estimator/search/acceleration_search.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "estimator/frame_estimator.hpp"
#include "estimator/likelihood/bound.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "protocol/error.hpp"
#include "tests/support/frame_maker.hpp"
#include "tests/support/sanitized.hpp"

namespace splid {
namespace {

constexpr double curvature_c_m_per_ns = 0.299792458;

test::FrameMaker accelerating_scene(double length_ms, double acceleration_mps2) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.length_ms = length_ms;
  made.acceleration_mps2 = acceleration_mps2;
  made.velocity_mps = 40;
  return made;
}

FrameEstimator estimator_for(const test::FrameMaker& made, Motion motion,
                             const EstimatorOptions& options = {}) {
  return {made.pattern, {}, {.motion = motion}, options, made.length_ms, 400'000};
}

double curvature_delay_error(const Estimate& estimate, const test::FrameMaker& made) {
  const double circle_ns = made.pattern.unambiguous_delay_ps * 1e-3;
  return std::remainder(estimate.delay_ns - 2 * made.distance_m / curvature_c_m_per_ns, circle_ns);
}

// Light from a target at 100 m/s^2, timed to 1 ps: without its curvature of 13 ns every photon lies
// on the line that the acceleration, the velocity and the distance make.
TEST(AccelerationSearch, AStraightenedFrameHasTheTargetOnALine) {
  const std::vector<Pattern> patterns = {test::interleaved_pattern({180000, 189000}, 3780000),
                                         test::mrr_pattern({180000, 189000}, 3780000, 1e9)};
  for (const Pattern& pattern : patterns) {
    test::FrameMaker made = accelerating_scene(200, 100);
    made.pattern = pattern;
    made.sigma_ns = 0.001;
    made.signal_per_pulse = 1e-3;
    made.background_per_ns = 0;
    const auto frame = made.make(3);
    const PulseTrain train(made.pattern);
    FoldedFrame curved(train, frame.photons_ps.size(), 50);
    FoldedFrame straight(train, frame.photons_ps.size());
    curved.fold(frame.view(), train);
    const double curvature_ns = 100 / 299792458.0 * curved.length_ns * curved.length_ns * 1e-9;
    EXPECT_NEAR(curvature_ns, 13.34, 0.01);
    straight.straighten(curved, curvature_ns / 6, train);
    const double beta = made.velocity_mps / 299792458.0;
    const DelayTrack line = {
        2 * made.distance_m / curvature_c_m_per_ns / (1 + beta) + curvature_ns / 12,
        2 * beta / (1 + beta) * straight.length_ns};
    NearSet near(frame.photons_ps.size(), 2 * frame.photons_ps.size());
    near.collect(straight, comb_windows(train, -0.02, 0.02), train, line);
    // All but those in the few periods after a change of rate, when the last rate's light arrives.
    EXPECT_GT(static_cast<double>(near.photons()),
              0.98 * static_cast<double>(frame.photons_ps.size()));
    double mean = 0;
    for (const double residual : near.residual_ns) mean += residual;
    EXPECT_NEAR(mean / static_cast<double>(near.entries()), 0, 2e-4);
  }
}

struct CurvatureSums {
  double delay = 0, velocity = 0, acceleration = 0, delay_std = 0, acceleration_std = 0;
};

// The rms of 100 normal errors over their deviation is 1 within 0.21 (3 sigma). The paths curve by
// eight pulse widths, towards and away.
TEST(AccelerationSearch, ErrorsAreWhatTheDeviationsSay) {
  const std::vector<Pattern> patterns = {test::interleaved_pattern({180000, 189000}, 3780000),
                                         test::random_pattern(3780000, 40, 9000, 5),
                                         test::mrr_pattern({180000, 189000}, 3780000, 1e8)};
  constexpr int frames = 100;
  for (const Pattern& pattern : patterns) {
    test::FrameMaker made = accelerating_scene(50, 0);
    made.pattern = pattern;
    if (pattern.mode == Mode::mrr) made.signal_per_pulse *= 2;
    FrameEstimator estimator = estimator_for(made, Motion::accelerating);
    CurvatureSums sums;
    for (int n = 0; n < frames; ++n) {
      made.acceleration_mps2 = -100 + 2 * n;
      made.velocity_mps = 140 - 2.8 * n;
      made.distance_m = 284.5 + 0.0137 * n;
      const Estimate e = estimator.estimate(made.make(static_cast<std::uint64_t>(n)).view());
      ASSERT_EQ(e.status, FrameStatus::ok) << n;
      sums.delay += std::pow(curvature_delay_error(e, made) / e.std_delay_ns, 2) / frames;
      sums.velocity +=
          std::pow((e.velocity_mps - made.velocity_mps) / e.std_velocity_mps, 2) / frames;
      sums.acceleration +=
          std::pow((e.acceleration_mps2 - made.acceleration_mps2) / e.std_acceleration_mps2, 2) /
          frames;
      sums.delay_std += e.std_delay_ns / frames;
      sums.acceleration_std += e.std_acceleration_mps2 / frames;
    }
    EXPECT_NEAR(std::sqrt(sums.delay), 1, 0.25);
    EXPECT_NEAR(std::sqrt(sums.velocity), 1, 0.25);
    EXPECT_NEAR(std::sqrt(sums.acceleration), 1, 0.25);
    const Bound bound =
        cramer_rao_bound(made.pattern, *make_gaussian(made.sigma_ns),
                         {50e6, 50e6, 2 * made.distance_m / curvature_c_m_per_ns, 0,
                          made.signal_per_pulse, made.background_per_ns, true, true});
    EXPECT_NEAR(sums.delay_std / bound.delay_ns, 1, 0.05);
    EXPECT_NEAR(sums.acceleration_std / bound.acceleration_mps2, 1, 0.05);
  }
}

// 13 ns of curvature are 130 pulse widths, and 1 s at 100 m/s^2 curves by 333 ns. The
// light is that of a frame of 50 ms at a sixth of [P]'s, as far above its background's deviation.
TEST(AccelerationSearch, NothingIsLostWhereThePathCurvesByMoreThanAPulse) {
  for (const double length_ms : {200.0, 1000.0}) {
    for (const double acceleration_mps2 : {100.0, -73.0}) {
      test::FrameMaker made = accelerating_scene(length_ms, acceleration_mps2);
      made.signal_per_pulse = 2.2e-4 * std::sqrt(50 / length_ms);
      FrameEstimator estimator = estimator_for(made, Motion::accelerating);
      const std::uint64_t frames = length_ms < 500 ? 4 : 1;
      for (std::uint64_t seed = 0; seed < frames; ++seed) {
        const Estimate e = estimator.estimate(made.make(seed).view());
        ASSERT_TRUE(e.has_values) << length_ms << " " << acceleration_mps2;
        EXPECT_LT(std::abs(curvature_delay_error(e, made)), 5 * e.std_delay_ns);
        EXPECT_LT(std::abs(e.velocity_mps - made.velocity_mps), 5 * e.std_velocity_mps);
        EXPECT_LT(std::abs(e.acceleration_mps2 - acceleration_mps2), 5 * e.std_acceleration_mps2);
      }
    }
  }
}

// In the sample of this frame of 350,000 photons the best cell has the wrong curvature, and a zoom
// into it ends on a part of the path with a third of the light: 134 nats, where the path gains 900.
// That zoom has half of the cell's light, which says that the path is elsewhere.
TEST(AccelerationSearch, DoesNotEndOnAPartOfThePath) {
  test::FrameMaker made = accelerating_scene(2000, -10);
  made.signal_per_pulse = 2.7e-4;
  made.velocity_mps = 19.942454249221427;
  made.distance_m = 284.56381921262482;
  FrameEstimator estimator = {made.pattern, {},   {.motion = Motion::accelerating},
                              {},           2000, 1'010'000};
  const Estimate e = estimator.estimate(made.make(129).view());
  EXPECT_EQ(e.status, FrameStatus::ok);
  EXPECT_LT(std::abs(e.acceleration_mps2 + 10), 4 * e.std_acceleration_mps2);
  EXPECT_LT(std::abs(e.velocity_mps - made.velocity_mps), 4 * e.std_velocity_mps);
  EXPECT_LT(std::abs(e.signal_per_pulse - made.signal_per_pulse), 4 * e.std_signal_per_pulse);
}

// At 100 m/s^2 a target that is 100 km off changes its speed by 3.3 cm/s while its light returns.
TEST(AccelerationSearch, TheVelocityIsThatAtMidFrameHoweverFarTheTarget) {
  test::FrameMaker made = accelerating_scene(50, 100);
  made.pattern = test::periodic_pattern(7e8);
  made.distance_m = 1e5;
  made.signal_per_pulse = 1000;
  const auto frame = made.make(1);
  const Estimate e = estimator_for(made, Motion::accelerating).estimate(frame.view());
  ASSERT_EQ(e.status, FrameStatus::ok);
  EXPECT_LT(e.std_velocity_mps, 0.006);
  EXPECT_LT(std::abs(e.velocity_mps - made.velocity_mps), 4 * e.std_velocity_mps);
  EXPECT_LT(std::abs(curvature_delay_error(e, made)), 4 * e.std_delay_ns);
  const double half_s = static_cast<double>(frame.end_ps - frame.start_ps) * 0.5e-12;
  const double at_start_m = made.distance_m - made.velocity_mps * half_s + 50 * half_s * half_s;
  EXPECT_NEAR(e.delay_start_ns, std::fmod(2 * at_start_m / curvature_c_m_per_ns, 7e5), 0.02);
}

void expect_same(const Estimate& one, const Estimate& other) {
  EXPECT_EQ(one.delay_ns, other.delay_ns);
  EXPECT_EQ(one.velocity_mps, other.velocity_mps);
  EXPECT_EQ(one.std_delay_ns, other.std_delay_ns);
  EXPECT_EQ(one.significance_nats, other.significance_nats);
  EXPECT_EQ(one.range_odds_nats, other.range_odds_nats);
}

TEST(AccelerationSearch, AutoTakesAPathAsStraightUnlessThePhotonsSayThatItCurves) {
  test::FrameMaker made = accelerating_scene(50, 0);
  FrameEstimator automatic = estimator_for(made, Motion::automatic);
  FrameEstimator moving = estimator_for(made, Motion::moving);
  int curved = 0, unsure = 0;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const auto frame = made.make(seed);
    const Estimate e = automatic.estimate(frame.view());
    curved += e.std_acceleration_mps2 > 0 ? 1 : 0;
    if (e.std_acceleration_mps2 > 0) continue;
    // Where a curvature is likely and not sure, the deviation of the delay holds it.
    Estimate straight = moving.estimate(frame.view());
    unsure += e.std_delay_ns > straight.std_delay_ns ? 1 : 0;
    straight.std_delay_ns = std::max(straight.std_delay_ns, e.std_delay_ns);
    expect_same(e, straight);
  }
  EXPECT_LE(curved, 2);  // of 30, where three deviations make one in 370
  EXPECT_LE(unsure, 5);  // of 30, where two deviations make one in 22
  made = accelerating_scene(200, 60);
  FrameEstimator longer = estimator_for(made, Motion::automatic);
  FrameEstimator accelerating = estimator_for(made, Motion::accelerating);
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const auto frame = made.make(seed);
    const Estimate e = longer.estimate(frame.view());
    ASSERT_GT(e.std_acceleration_mps2, 0);
    const Estimate other = accelerating.estimate(frame.view());
    EXPECT_NEAR(e.delay_ns, other.delay_ns, 0.05 * e.std_delay_ns);
    EXPECT_NEAR(e.acceleration_mps2, other.acceleration_mps2, 0.05 * e.std_acceleration_mps2);
  }
}

// A target that turns round while it is followed: from one frame to the next its velocity changes
// by 20 m/s and its delay by 13 ns more than the velocity says.
TEST(AccelerationSearch, FollowsATargetThatAccelerates) {
  test::FrameMaker made = accelerating_scene(200, 100);
  FrameEstimator estimator = estimator_for(made, Motion::accelerating, {.tracked = true});
  TargetTrack track;
  for (int n = 0; n < 8; ++n) {
    const double time_s = 0.2 * n;
    made.start_ps = 200'000'000'000LL * n;
    made.velocity_mps = -30 + 100 * time_s;
    made.distance_m = 284.5 - 30 * time_s + 50 * time_s * time_s;
    const Estimate e = estimator.estimate(made.make(static_cast<std::uint64_t>(n)).view(), &track);
    ASSERT_EQ(e.status, FrameStatus::ok) << n;
    EXPECT_LT(std::abs(curvature_delay_error(e, made)), 5 * e.std_delay_ns) << n;
    EXPECT_EQ(track.followed, n) << n;
  }
}

// Frames of background alone, at 10 %: 20 of 200 expected, deviation 4.2.
TEST(AccelerationSearch, FalseAlarmsComeAtMostAtTheRateAskedFor) {
  test::FrameMaker made = accelerating_scene(20, 0);
  made.signal_per_pulse = 0;
  EstimatorOptions options;
  options.false_alarm_rate = 0.1;
  const int frames = test::times(200);
  for (const Motion motion : {Motion::accelerating, Motion::automatic}) {
    FrameEstimator estimator = estimator_for(made, motion, options);
    int alarms = 0;
    for (int seed = 0; seed < frames; ++seed) {
      alarms += estimator.estimate(made.make(seed).view()).has_values ? 1 : 0;
    }
    EXPECT_LE(alarms, 0.1 * frames + 3.1 * std::sqrt(0.09 * frames));
  }
}

TEST(AccelerationSearch, TheMethodOfThePaperKnowsNoAcceleration) {
  const test::FrameMaker made = accelerating_scene(50, 0);
  EXPECT_THROW(estimator_for(made, Motion::accelerating, {.method = Method::paper}), Error);
  EXPECT_NO_THROW(estimator_for(made, Motion::automatic, {.method = Method::paper}));
}

// Curvature grows with the square of the frame's length, and the looks with them.
TEST(AccelerationSearch, RefusesCurvatureThatWouldTakeMinutes) {
  const test::FrameMaker made = accelerating_scene(10'000, 0);
  try {
    (void)estimator_for(made, Motion::accelerating);
    FAIL() << "not refused";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("/scene/max_acceleration_mps2"),
                                             testing::HasSubstr("/frame/length_ms")));
  }
  EXPECT_NO_THROW(estimator_for(made, Motion::automatic));
}

}  // namespace
}  // namespace splid
