#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "estimator/checks/path_check.hpp"
#include "estimator/frame_estimator.hpp"
#include "estimator/model/units.hpp"
#include "tests/support/frame_maker.hpp"
#include "tests/support/sanitized.hpp"

// Paths whose acceleration changes over the frame.

namespace splid {
namespace {

constexpr double turn_width_ns = 0.1;

// What the check says of a target's light about a path that is off by turn_ns s^3, of which a fit
// has taken what a delay, a travel and a bend can.
PathVerdict verdict_of(PathCheck& check, double turn_ns, int photons, std::mt19937_64& random) {
  std::normal_distribution<double> pulse(0, turn_width_ns);
  std::uniform_real_distribution<double> over(-0.5, 0.5), around(-0.9, 0.9);
  std::poisson_distribution<int> light(photons);
  check.begin(photons, 30, true);
  for (int n = light(random); n > 0; --n) {
    const double s = over(random);
    check.add(pulse(random) + turn_ns * (s * s * s - 0.15 * s), s);
  }
  for (int n = 0; n < 54; ++n) check.add(around(random), over(random));
  return check.judge(1, true);
}

struct Turns {
  double mean_ns = 0, mean_travel_ns = 0, mean_deviations = 0, rms_deviations = 0;
  int said = 0;
};

Turns turns_of(double turn_ns, int photons, int draws) {
  const GaussianPulse shape(turn_width_ns);
  PathCheck check(shape, 9);
  std::mt19937_64 random(17);
  Turns turns;
  for (int n = 0; n < draws; ++n) {
    const PathVerdict verdict = verdict_of(check, turn_ns, photons, random);
    turns.mean_ns += verdict.turn_ns / draws;
    turns.mean_travel_ns += verdict.turn_travel_ns / draws;
    turns.mean_deviations += verdict.turn_deviations / draws;
    turns.rms_deviations += verdict.turn_deviations * verdict.turn_deviations / draws;
    turns.said += verdict.turns() ? 1 : 0;
  }
  turns.rms_deviations = std::sqrt(turns.rms_deviations);
  return turns;
}

// Of n draws the mean of the deviations is known to 1 / sqrt(n), and their rms to 0.7 of that.
TEST(PathTurn, OfAParabolaIsNone) {
  const int draws = test::times(3000);
  const double unsure = 1 / std::sqrt(draws);
  for (const int photons : {100, 200, 700, 5000}) {
    const Turns turns = turns_of(0, photons, draws);
    EXPECT_NEAR(turns.mean_deviations, 0, 4.4 * unsure) << photons;
    EXPECT_NEAR(turns.rms_deviations, 1, 3.3 * unsure) << photons;
    EXPECT_EQ(turns.said, 0) << photons;
  }
}

// A turn of 700 photons has a deviation of sqrt(2800 / 700) = 2 pulse widths, and puts the travel
// off by 3/20 of itself. One step says some 6 % less of 12 widths.
TEST(PathTurn, IsSaidWithWhatItPutsTheTravelOffBy) {
  for (const double widths : {-12.0, 12.0}) {
    const Turns turns = turns_of(widths * turn_width_ns, 700, 300);
    EXPECT_NEAR(turns.mean_ns, 0.94 * widths * turn_width_ns, 0.1);
    EXPECT_NEAR(turns.mean_travel_ns, 0.15 * 0.94 * 12 * turn_width_ns, 0.02);
    EXPECT_NEAR(std::abs(turns.mean_deviations), 5.6, 0.6);
    EXPECT_GT(turns.said, 150);
  }
}

test::FrameMaker turning_target(double length_ms, double jerk_mps3) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.length_ms = length_ms;
  made.velocity_mps = 30;
  made.acceleration_mps2 = 6;
  made.jerk_mps3 = jerk_mps3;
  return made;
}

double velocity_off(const Estimate& e, const test::FrameMaker& made) {
  return std::abs(e.velocity_mps - made.velocity_mps);
}

// The velocity is off by j t_a^2 / 40 = 0.1 m/s, 20 of its deviations.
TEST(TurnOfAFrame, IsSaidAndInTheDeviationOfTheVelocity) {
  const test::FrameMaker made = turning_target(200, 100);
  for (const Motion motion : {Motion::accelerating, Motion::automatic}) {
    FrameEstimator estimator(made.pattern, {}, {.motion = motion, .max_acceleration_mps2 = 20}, {},
                             made.length_ms, 200'000);
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      const Estimate e = estimator.estimate(made.make(seed).view());
      ASSERT_EQ(e.status, FrameStatus::ok);
      EXPECT_GT(e.std_acceleration_mps2, 0);
      ASSERT_TRUE(e.jerk_misfit_mps3) << seed;
      EXPECT_NEAR(*e.jerk_misfit_mps3, 100, 40);
      EXPECT_NEAR(velocity_off(e, made), 100 * 0.2 * 0.2 / 40, 0.03);
      EXPECT_LT(velocity_off(e, made), 2 * e.std_velocity_mps);
      EXPECT_GT(e.path_excess.value(), 4.5);
    }
  }
}

// Where the acceleration passes through zero at mid-frame, a straight path is fitted. Where targets
// are not taken to accelerate, no frame says a jerk.
TEST(TurnOfAFrame, IsSaidOfAStraightPathToo) {
  test::FrameMaker made = turning_target(200, 100);
  made.acceleration_mps2 = 0;
  FrameEstimator automatic(made.pattern, {},
                           {.motion = Motion::automatic, .max_acceleration_mps2 = 20}, {},
                           made.length_ms, 200'000);
  FrameEstimator moving(made.pattern, {}, {}, {}, made.length_ms, 200'000);
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const auto frame = made.make(seed);
    const Estimate e = automatic.estimate(frame.view());
    ASSERT_EQ(e.status, FrameStatus::ok);
    EXPECT_TRUE(e.jerk_misfit_mps3) << seed;
    EXPECT_LT(velocity_off(e, made), 2 * e.std_velocity_mps);
    EXPECT_TRUE(e.path_excess);
    const Estimate other = moving.estimate(frame.view());
    EXPECT_FALSE(other.jerk_misfit_mps3);
    EXPECT_GT(other.path_excess.value_or(0), 2);
  }
}

// The path leaves every parabola by some 50 pulse widths at the frame's ends.
TEST(TurnOfAFrame, ThatLeavesEveryParabolaHasAGapAndWideDeviations) {
  const test::FrameMaker made = turning_target(200, 30'000);
  FrameEstimator estimator(made.pattern, {}, {.motion = Motion::accelerating}, {}, made.length_ms,
                           200'000);
  int gaps = 0, off = 0, delays_off = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Estimate e = estimator.estimate(made.make(seed).view());
    ASSERT_EQ(e.status, FrameStatus::ok);
    EXPECT_TRUE(e.signal_gap || e.jerk_misfit_mps3) << seed;
    gaps += e.signal_gap ? 1 : 0;
    off += velocity_off(e, made) > 3 * e.std_velocity_mps ? 1 : 0;
    const double off_ns = e.delay_ns - 2 * made.distance_m / (speed_of_light_mps * 1e-9);
    delays_off += std::abs(off_ns) > 4 * e.std_delay_ns ? 1 : 0;
  }
  EXPECT_GE(gaps, 8);
  EXPECT_LE(delays_off, 1);
  EXPECT_LE(off, 1);
}

TEST(TurnOfAFrame, ThatIsNoneIsNotSaid) {
  const test::FrameMaker made = turning_target(50, 0);
  FrameEstimator estimator(made.pattern, {}, {.motion = Motion::accelerating}, {}, made.length_ms,
                           100'000);
  double squares = 0;
  const int frames = test::times(150);
  for (int seed = 1; seed <= frames; ++seed) {
    const Estimate e = estimator.estimate(made.make(seed).view());
    ASSERT_EQ(e.status, FrameStatus::ok);
    EXPECT_FALSE(e.jerk_misfit_mps3) << seed;
    EXPECT_FALSE(e.signal_gap) << seed;
    squares += std::pow(e.path_excess.value(), 2) / frames;
  }
  EXPECT_NEAR(squares, 1, 4 * std::sqrt(2.0 / frames));
}

double rms_excess(const test::FrameMaker& made, int frames) {
  FrameEstimator moving(made.pattern, {}, {}, {}, made.length_ms, 200'000);
  double squares = 0;
  for (int n = 1; n <= frames; ++n) {
    const Estimate e = moving.estimate(made.make(static_cast<std::uint64_t>(n)).view());
    EXPECT_TRUE(e.path_excess) << n;
    squares += std::pow(e.path_excess.value_or(0), 2) / frames;
  }
  return std::sqrt(squares);
}

// Each of the three is 1 by chance, so that their mean square has a variance of 2 / 3 or less. At
// 20 m/s^2 the distance is off by three of its deviations in 50 ms, which few frames say.
TEST(PathOfAFrame, ThatIsNotStraightShowsInManyFrames) {
  test::FrameMaker made = turning_target(50, 0);
  made.acceleration_mps2 = 0;
  const int frames = test::times(150);
  EXPECT_NEAR(rms_excess(made, frames), 1, 4 * 0.41 / std::sqrt(frames));
  made.acceleration_mps2 = 20;
  EXPECT_GT(rms_excess(made, 40), 1.6);
}

// A target that swings by a third of a pulse width, four times in a frame: neither a bend nor a
// turn.
TEST(PathSwing, IsInTheLightOfTheParts) {
  constexpr int photons = 400, draws = 200;
  const GaussianPulse shape(turn_width_ns);
  PathCheck check(shape, 9);
  std::mt19937_64 random(19);
  std::normal_distribution<double> pulse(0, turn_width_ns);
  std::uniform_real_distribution<double> over(-0.5, 0.5);
  for (const double swing_widths : {0.0, 0.33}) {
    double mean = 0, squares = 0;
    for (int n = 0; n < draws; ++n) {
      check.begin(photons, 30, true);
      for (int k = 0; k < photons; ++k) {
        const double s = over(random);
        const double off_ns = swing_widths * turn_width_ns * std::sin(8 * 3.14159265 * s);
        check.add(pulse(random) + off_ns, s);
      }
      const double deviations = check.judge(1).swing_deviations;
      mean += deviations / draws;
      squares += deviations * deviations / draws;
    }
    if (swing_widths == 0) {
      EXPECT_NEAR(mean, 0, 4 / std::sqrt(draws));
      EXPECT_NEAR(squares, 1, 4 * std::sqrt(2.5 / draws));
    } else {
      // Chi squared is 400 (0.33)^2 / 2 more where each part has many photons, not 12.
      EXPECT_GT(mean, 0.6 * 400 * 0.33 * 0.33 / 2 / std::sqrt(56));
    }
  }
}

// A path that bends by less than shows in a frame: 'auto' takes most frames as straight, whose
// distance is off by two deviations and more. Deviations hold what is likely.
TEST(TurnOfAFrame, ThatBendsALittleHasWiderDeviationsWithAuto) {
  test::FrameMaker made = turning_target(200, 0);
  made.acceleration_mps2 = 0.4;
  FrameEstimator automatic(made.pattern, {}, {.motion = Motion::automatic}, {}, made.length_ms,
                           200'000);
  FrameEstimator moving(made.pattern, {}, {}, {}, made.length_ms, 200'000);
  int straight = 0, wider = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const auto frame = made.make(seed);
    const Estimate e = automatic.estimate(frame.view());
    if (e.std_acceleration_mps2 > 0) continue;
    ++straight;
    wider += e.std_delay_ns > 1.5 * moving.estimate(frame.view()).std_delay_ns ? 1 : 0;
  }
  EXPECT_GT(straight, 20);
  EXPECT_GT(4 * wider, straight);
}

}  // namespace
}  // namespace splid
