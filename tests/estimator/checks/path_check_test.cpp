#include "estimator/checks/path_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "estimator/frame_estimator.hpp"
#include "estimator/model/units.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

constexpr double sent_width_ns = 0.1;

// A target's light over a frame, and background about its pulses.
struct PathLight {
  int photons = 700;
  double bend_ns = 0;
  double parting_ns = 0;     // of two that cross at mid-frame, half of what they part by
  double wide = 1;           // the pulse, in widths
  double from_share = -0.5;  // of the frame, from which on the target is there
  double background_per_ns = 30;
  bool sends_evenly = true;
  int other_photons = 0;  // of another target
  double other_offset_ns = 0, other_travel_ns = 0;

  // What the check says of one draw. The line is as far off in delay and travel as chance has it.
  PathVerdict drawn(PathCheck& check, std::mt19937_64& random) const {
    std::normal_distribution<double> pulse(0, sent_width_ns);
    std::uniform_real_distribution<double> over(from_share, 0.5), all(-0.5, 0.5), around(-0.9, 0.9);
    std::poisson_distribution<int> light(photons), dark(1.8 * background_per_ns);
    const double off_ns = pulse(random) / std::sqrt(photons);
    const double travel_off_ns = pulse(random) * std::sqrt(12.0 / photons);
    check.begin(photons, background_per_ns, sends_evenly);
    for (int n = light(random); n > 0; --n) {
      const double s = over(random);
      const double side = parting_ns > 0 && n % 2 == 0 ? -1 : 1;
      check.add(wide * pulse(random) + off_ns + travel_off_ns * s + bend_ns * (s * s - 1.0 / 12) +
                    side * parting_ns * s,
                s);
    }
    for (int n = dark(random); n > 0; --n) check.add(around(random), all(random));
    for (int n = 0; n < other_photons; ++n) {
      const double s = all(random);
      check.add(other_offset_ns + other_travel_ns * s + pulse(random), s);
    }
    return check.judge(1);
  }
};

struct Drawn {
  double mean_bend_ns = 0, mean_deviations = 0, rms_deviations = 0;
  int bent = 0, straight = 0, parted = 0, met = 0, met_if_misfit = 0;
  double mean_left = 0, mean_beside_deviations = 0;
  double mean_gap = 0;
  double rms_parting_deviations = 0;  // of those above 0
  double mean_parting_ns = 0;
};

Drawn draw(const PathLight& light, int draws) {
  const GaussianPulse shape(sent_width_ns);
  PathCheck check(shape, 9);
  std::mt19937_64 random(11);
  Drawn drawn;
  for (int n = 0; n < draws; ++n) {
    const PathVerdict verdict = light.drawn(check, random);
    drawn.mean_bend_ns += verdict.bend_ns / draws;
    drawn.mean_deviations += verdict.deviations / draws;
    drawn.rms_deviations += verdict.deviations * verdict.deviations / draws;
    drawn.mean_gap += verdict.signal_gap / draws;
    drawn.bent += verdict.bends() ? 1 : 0;
    drawn.straight += verdict.is_straight() ? 1 : 0;
    drawn.parted += verdict.parts() ? 1 : 0;
    drawn.rms_parting_deviations += std::pow(verdict.parting_deviations, 2) / draws;
    drawn.mean_parting_ns += verdict.parting_ns / draws;
    drawn.met += verdict.is_met(false) ? 1 : 0;
    drawn.met_if_misfit += verdict.is_met(true) ? 1 : 0;
    drawn.mean_left += verdict.left / draws;
    drawn.mean_beside_deviations += verdict.beside_deviations / draws;
  }
  drawn.rms_deviations = std::sqrt(drawn.rms_deviations);
  return drawn;
}

// Of 3000 draws the mean of the deviations is known to 0.018 and their rms to 1.3 %. A straight
// path is within two deviations in 95.4 %.
TEST(PathCheck, TakesAStraightPathAsStraight) {
  for (const int photons : {150, 700, 5000}) {
    PathLight light;
    light.photons = photons;
    const Drawn drawn = draw(light, 3000);
    EXPECT_NEAR(drawn.mean_deviations, 0, 0.08) << photons;
    EXPECT_NEAR(drawn.rms_deviations, 1, 0.06) << photons;
    EXPECT_EQ(drawn.bent, 0) << photons;
    EXPECT_EQ(drawn.mean_gap, 0) << photons;
    EXPECT_NEAR(drawn.straight, 0.953 * 3000, 50) << photons;
  }
}

// The bend of 700 photons has a deviation of 0.51 pulse widths.
TEST(PathCheck, SaysHowMuchAPathBends) {
  for (const double widths : {-1.0, 0.5, 1.0}) {
    PathLight light;
    light.bend_ns = widths * sent_width_ns;
    EXPECT_NEAR(draw(light, 1000).mean_bend_ns, light.bend_ns, 0.1 * std::abs(light.bend_ns));
  }
  PathLight light;
  light.bend_ns = 5 * sent_width_ns;
  const Drawn drawn = draw(light, 300);
  EXPECT_EQ(drawn.bent, 300);
  EXPECT_EQ(drawn.straight, 0);
}

// Whatever the pulse's width, its light is spread alike over the frame: half of the draws are above
// none, with the mean square of one. Of 2000 draws that is known to 0.05.
TEST(PathCheck, APulseDoesNotPart) {
  for (const double wide : {1.0, 1.5, 2.5}) {
    PathLight light;
    light.wide = wide;
    const Drawn drawn = draw(light, 2000);
    EXPECT_EQ(drawn.parted, 0) << wide;
    EXPECT_NEAR(drawn.rms_parting_deviations, 0.5, 0.1) << wide;
  }
}

// One step of scoring tells half of how far two part at a few widths, and the more of it the less
// that is.
TEST(PathCheck, SaysHowFarTwoPart) {
  PathLight light;
  light.photons = 1400;
  for (const double widths : {2.0, 3.0}) {
    light.parting_ns = widths * sent_width_ns;
    const Drawn drawn = draw(light, 200);
    EXPECT_GE(drawn.parted, widths > 2 ? 199 : 150);
    EXPECT_GT(drawn.mean_parting_ns, 0.5 * light.parting_ns);
    EXPECT_LT(drawn.mean_parting_ns, light.parting_ns);
  }
  light.parting_ns = 0;
  light.bend_ns = 8 * sent_width_ns;
  EXPECT_EQ(draw(light, 200).parted, 0);  // it bends
}

// Chi squared with 7 degrees of freedom has a mean of 7, and is above the limit in 5 %.
TEST(PathCheck, NothingMeetsATargetThatIsAlone) {
  for (const int photons : {150, 700, 5000}) {
    for (const double wide : {1.0, 1.5}) {
      PathLight light;
      light.photons = photons;
      light.wide = wide;
      const Drawn drawn = draw(light, 3000);
      EXPECT_NEAR(drawn.mean_left, 7, 0.7) << photons << ' ' << wide;
      EXPECT_EQ(drawn.met, 0) << photons << ' ' << wide;
      EXPECT_NEAR(drawn.met_if_misfit, 150, 60) << photons << ' ' << wide;
      if (wide == 1) {
        EXPECT_NEAR(drawn.mean_beside_deviations, 0, 0.1) << photons;
      }
    }
  }
}

// Light that stays 7 widths beside the path does not meet it, and light that comes to it at the
// frame's end does.
TEST(PathCheck, SeesOtherLightThatMeetsTheTargets) {
  PathLight light;
  light.other_photons = 350;
  light.other_offset_ns = 7 * sent_width_ns;
  const Drawn beside = draw(light, 1000);
  EXPECT_GT(beside.mean_beside_deviations, 15);
  EXPECT_NEAR(beside.met, 50, 30);
  light.other_travel_ns = 12 * sent_width_ns;
  const Drawn meeting = draw(light, 1000);
  EXPECT_GT(meeting.mean_beside_deviations, 15);
  EXPECT_GT(meeting.met, 900);
}

TEST(PathCheck, SeesTheGapOfATargetThatIsThereInAPartOfTheFrame) {
  PathLight light;
  light.from_share = 0;
  const Drawn half = draw(light, 300);
  EXPECT_EQ(half.straight, 0);
  EXPECT_NEAR(half.mean_gap, 0.5, 0.001);
  light.sends_evenly = false;
  EXPECT_EQ(draw(light, 300).mean_gap, 0);
  EXPECT_EQ(draw(light, 300).straight, 0);
}

TEST(PathCheck, SaysNothingOfTooFewPhotonsOrOfPulsesTooCloseToEachOther) {
  PathLight light;
  light.photons = 20;
  light.bend_ns = 20 * sent_width_ns;
  const Drawn drawn = draw(light, 100);
  EXPECT_EQ(drawn.bent, 0);
  EXPECT_EQ(drawn.straight, 0);
  const GaussianPulse shape(sent_width_ns);
  PathCheck check(shape, 4 * sent_width_ns);
  std::mt19937_64 random(3);
  light.photons = 700;
  const PathVerdict verdict = light.drawn(check, random);
  EXPECT_EQ(verdict.photons, 0);
  EXPECT_FALSE(verdict.bends());
}

test::FrameMaker accelerating_target(double acceleration_mps2) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.velocity_mps = 20;
  made.acceleration_mps2 = acceleration_mps2;
  return made;
}

// At 50 m/s^2 the path bends by four pulse widths, and the delay is off by a third of one.
TEST(PathOfAFrame, ThatBendsAndIsTakenAsStraightIsSaid) {
  const test::FrameMaker made = accelerating_target(50);
  for (const Motion motion : {Motion::moving, Motion::automatic}) {
    SceneOptions scene;
    scene.motion = motion;
    scene.max_acceleration_mps2 = 0;
    FrameEstimator estimator(made.pattern, {}, scene, {}, made.length_ms, 100'000);
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      const Estimate e = estimator.estimate(made.make(seed).view());
      ASSERT_EQ(e.status, FrameStatus::ok);
      ASSERT_TRUE(e.acceleration_misfit_mps2) << seed;
      EXPECT_GT(*e.acceleration_misfit_mps2, 20);
      EXPECT_LT(*e.acceleration_misfit_mps2, 80);
      const double off_ns = e.delay_ns - 2 * made.distance_m / (speed_of_light_mps * 1e-9);
      EXPECT_GT(std::abs(off_ns), 0.02);
      EXPECT_LT(std::abs(off_ns), 2 * e.std_delay_ns);
    }
  }
}

// A target that is taken to be at rest turns around in mid-frame: its velocity stays as it was
// taken.
TEST(PathOfAFrame, ThatBendsAboutRestIsSaid) {
  test::FrameMaker made = accelerating_target(50);
  made.velocity_mps = 0;
  FrameEstimator estimator(made.pattern, {}, {.motion = Motion::static_target}, {}, made.length_ms,
                           100'000);
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Estimate e = estimator.estimate(made.make(seed).view());
    ASSERT_EQ(e.status, FrameStatus::ok);
    EXPECT_TRUE(e.acceleration_misfit_mps2);
    EXPECT_EQ(e.std_velocity_mps, 0);
  }
}

// At 100 m/s^2 the path bends by 67 pulse widths in 200 ms, and the best straight line touches it.
// Errors are within their deviations in two of three frames, and within four in all but some.
TEST(PathOfAFrame, ThatALineOnlyTouchesHasAGapAndWideDeviations) {
  test::FrameMaker made = accelerating_target(100);
  made.length_ms = 200;
  FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, 200'000);
  int delays_off = 0, velocities_off = 0;
  constexpr int frames = 20;
  for (std::uint64_t seed = 1; seed <= frames; ++seed) {
    const Estimate e = estimator.estimate(made.make(seed).view());
    ASSERT_EQ(e.status, FrameStatus::ok);
    ASSERT_TRUE(e.signal_gap) << seed;
    EXPECT_GE(*e.signal_gap, 0.25);
    const double off_ns = e.delay_ns - 2 * made.distance_m / (speed_of_light_mps * 1e-9);
    delays_off += std::abs(off_ns) > 4 * e.std_delay_ns ? 1 : 0;
    velocities_off += std::abs(e.velocity_mps - made.velocity_mps) > 4 * e.std_velocity_mps ? 1 : 0;
  }
  EXPECT_LT(delays_off, 4);
  EXPECT_LT(velocities_off, 4);
}

// Two at the same distance are taken for one whose velocity is between theirs.
TEST(PathOfAFrame, OfTwoThatPartHasADeviationThatHoldsBothVelocities) {
  const test::FrameMaker first = accelerating_target(0);
  for (const double faster_mps : {1.5, 2.0, 3.0}) {
    test::FrameMaker second = first;
    second.velocity_mps += faster_mps;
    FrameEstimator estimator(first.pattern, {}, {}, {}, first.length_ms, 100'000);
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      const Estimate e = estimator.estimate(first.make_with({second}, seed).view());
      ASSERT_EQ(e.status, FrameStatus::ok);
      EXPECT_TRUE(e.pulse_misfit);
      for (const test::FrameMaker& target : {first, second}) {
        const double off_mps = std::abs(e.velocity_mps - target.velocity_mps);
        EXPECT_LT(off_mps, 2.5 * e.std_velocity_mps) << faster_mps << ' ' << seed;
      }
    }
  }
}

// A target of half the signal comes within a pulse width of the path at one end of the frame, and
// pulls the line there.
TEST(PathOfAFrame, ThatAnotherTargetMeetsHasDeviationsThatHoldThePull) {
  const test::FrameMaker first = accelerating_target(0);
  test::FrameMaker second = first;
  second.distance_m += 7 * 0.1 * 0.299792458 / 2;
  second.velocity_mps += 4;
  second.signal_per_pulse /= 2;
  FrameEstimator estimator(first.pattern, {}, {}, {}, first.length_ms, 100'000);
  const Estimate alone = estimator.estimate(first.make(1).view());
  int pulled = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const Estimate e = estimator.estimate(first.make_with({second}, seed).view());
    const double off_ns = std::remainder(e.delay_ns - 2 * first.distance_m / 0.299792458, 3780);
    const double off_mps = e.velocity_mps - first.velocity_mps;
    EXPECT_LT(std::abs(off_ns), 4.5 * e.std_delay_ns) << seed;
    EXPECT_LT(std::abs(off_mps), 4.5 * e.std_velocity_mps) << seed;
    const bool is_pulled = std::abs(off_ns) > 4.5 * alone.std_delay_ns ||
                           std::abs(off_mps) > 4.5 * alone.std_velocity_mps;
    pulled += is_pulled ? 1 : 0;
  }
  EXPECT_GT(pulled, 8);
}

TEST(PathOfAFrame, ThatIsStraightOrWhoseBendIsFittedSaysNothing) {
  for (const double acceleration_mps2 : {0.0, 50.0}) {
    const test::FrameMaker made = accelerating_target(acceleration_mps2);
    SceneOptions scene;
    scene.motion = acceleration_mps2 == 0 ? Motion::moving : Motion::accelerating;
    FrameEstimator estimator(made.pattern, {}, scene, {}, made.length_ms, 100'000);
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      const Estimate e = estimator.estimate(made.make(seed).view());
      ASSERT_EQ(e.status, FrameStatus::ok);
      EXPECT_FALSE(e.acceleration_misfit_mps2);
      EXPECT_FALSE(e.signal_gap);
    }
  }
}

}  // namespace
}  // namespace splid
