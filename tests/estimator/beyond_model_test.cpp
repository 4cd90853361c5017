#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include "estimator/checks/finding.hpp"
#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

// Light that the model does not have: what is published of it is never sure and wrong, and a target
// that is there stays valid.
namespace splid {
namespace {

constexpr double far_deviations = 5;
constexpr double half_c_m_per_ns = 0.299792458 / 2;

test::FrameMaker beyond_scene() {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.velocity_mps = 10;
  return made;
}

FrameEstimator beyond_estimator(const test::FrameMaker& made, const SceneOptions& scene = {},
                                const EstimatorOptions& options = {}) {
  return {made.pattern, {}, scene, options, made.length_ms, 200000};
}

bool is_far(const Estimate& e, const test::FrameMaker& made) {
  const double off_m = e.delay_ns * half_c_m_per_ns - made.distance_m;
  return std::abs(std::remainder(off_m, 566.6)) > far_deviations * e.std_delay_ns * half_c_m_per_ns;
}

// A detection at one place of the period in a share of the periods, as a pick-up of the sync makes.
void add_pick_up(test::FrameMaker::Frame& frame, double share, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> jitter(0, 30);
  std::bernoulli_distribution comes(share);
  for (std::int64_t at = frame.start_ps + 1234567; at < frame.end_ps; at += 3780000) {
    if (comes(random)) frame.photons_ps.push_back(at + std::llround(jitter(random)));
  }
  std::sort(frame.photons_ps.begin(), frame.photons_ps.end());
}

TEST(BeyondModel, APickUpOfTheSyncsLeavesATargetValid) {
  const test::FrameMaker made = beyond_scene();
  FrameEstimator estimator = beyond_estimator(made);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    auto frame = made.make(seed);
    add_pick_up(frame, 0.05, seed);
    const Estimate e = estimator.estimate(frame.view());
    EXPECT_EQ(e.status, FrameStatus::ok) << seed;
    EXPECT_TRUE(e.findings.has(FindingName::unmodelled_light)) << seed;
    EXPECT_FALSE(is_far(e, made)) << seed;
  }
}

TEST(BeyondModel, LightOfAnotherLaserAloneIsNoTarget) {
  test::FrameMaker made = beyond_scene();
  made.signal_per_pulse = 0;
  FrameEstimator estimator = beyond_estimator(made);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    auto frame = made.make(seed);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> jitter(0, 100);
    std::geometric_distribution<std::int64_t> dark(160e3 / 80e6);  // pulses before one that is seen
    for (std::int64_t at = frame.start_ps + 12500 * dark(random); at < frame.end_ps;
         at += 12500 * (1 + dark(random))) {
      frame.photons_ps.push_back(at + std::llround(jitter(random)));
    }
    std::erase_if(frame.photons_ps,
                  [&](std::int64_t t) { return t < frame.start_ps || t >= frame.end_ps; });
    std::sort(frame.photons_ps.begin(), frame.photons_ps.end());
    EXPECT_NE(estimator.estimate(frame.view()).status, FrameStatus::ok) << seed;
  }
}

// A room light of 20 Hz with full swing: the target's light does not fade.
TEST(BeyondModel, BackgroundThatVariesIsNoFading) {
  test::FrameMaker made = beyond_scene();
  made.background_per_ns = 1e-3;
  made.background_swing = 1;
  made.swing_hz = 20;
  FrameEstimator estimator = beyond_estimator(made);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto frame = made.make(seed);
    const Estimate e = estimator.estimate(frame.view());
    EXPECT_EQ(e.status, FrameStatus::ok) << seed;
    EXPECT_FALSE(e.findings.has(FindingName::fading)) << seed;
    EXPECT_FALSE(is_far(e, made)) << seed;
  }
}

// Its velocity is then known four times as badly: half of the light, over half of the time.
TEST(BeyondModel, ATargetThatIsLitForHalfOfTheFrameKeepsItsVelocity) {
  const test::FrameMaker made = beyond_scene();
  FrameEstimator estimator = beyond_estimator(made);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    auto frame = made.make(seed);
    const double std_mps = estimator.estimate(frame.view()).std_velocity_mps;
    auto dark = made;
    dark.signal_per_pulse = 0;
    const auto other = dark.make(seed + 100);
    const std::int64_t mid = frame.view().mid_ps();
    std::erase_if(frame.photons_ps, [&](std::int64_t t) { return t >= mid; });
    for (const std::int64_t t : other.photons_ps) {
      if (t >= mid) frame.photons_ps.push_back(t);
    }
    const Estimate e = estimator.estimate(frame.view());
    EXPECT_EQ(e.status, FrameStatus::ok) << seed;
    EXPECT_TRUE(e.findings.has(FindingName::fading)) << seed;
    EXPECT_LT(e.std_velocity_mps, 8 * std_mps) << seed;
    EXPECT_LT(std::abs(e.velocity_mps - 10), far_deviations * e.std_velocity_mps) << seed;
  }
}

// A width apart at mid-frame, and 1 m/s: one target between them has the velocity of neither.
TEST(BeyondModel, TwoThatPartAreNotOneWithASureVelocity) {
  const test::FrameMaker first = beyond_scene();
  const test::FrameMaker second = first.beside(0.015, 1, 1);
  FrameEstimator estimator = beyond_estimator(first);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Estimate e = estimator.estimate(first.make_with({second}, seed).view());
    EXPECT_TRUE(e.findings.has(FindingName::pulse_width)) << seed;
    const double off_mps = std::min(std::abs(e.velocity_mps - first.velocity_mps),
                                    std::abs(e.velocity_mps - second.velocity_mps));
    EXPECT_LT(off_mps, far_deviations * e.std_velocity_mps) << seed;
    EXPECT_LT(e.std_velocity_mps, 2) << seed;
  }
}

// Pulses as bright as half a photon, before a detector that is dead for 50 ns after each: of 40
// pulses those behind another one are seen less, whatever bin of phase their photons fall into.
TEST(BeyondModel, BrightPulsesBeforeADetectorWithDeadTimeAreInTheModel) {
  test::FrameMaker made = beyond_scene();
  made.length_ms = 5;
  made.signal_per_pulse = 0.5;
  made.dead_time_ns = 50;
  DetectorOptions detector;
  detector.dead_time_ns = 50;
  FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, 200000, ClockReference::tagger,
                           detector);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Estimate e = estimator.estimate(made.make(seed).view());
    EXPECT_EQ(e.status, FrameStatus::ok) << seed;
    EXPECT_TRUE(e.findings.all().empty()) << seed;
    EXPECT_TRUE(e.recent_findings.all().empty()) << seed;
  }
}

// Frames of several pixels in turn are not summed up.
TEST(BeyondModel, RecentFindingsAreOfOnePixelOrOfNone) {
  test::FrameMaker wide = beyond_scene();
  wide.sigma_ns = 0.12;
  FrameEstimator of_one = beyond_estimator(wide);
  FrameEstimator of_several = beyond_estimator(wide);
  of_several.leave_out_recent_findings();
  Estimate one, several;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const auto frame = wide.make(seed);
    one = of_one.estimate(frame.view());
    several = of_several.estimate(frame.view());
    EXPECT_EQ(one.delay_ns, several.delay_ns) << seed;
  }
  EXPECT_TRUE(one.recent_findings.has(FindingName::pulse_width));
  EXPECT_TRUE(several.recent_findings.all().empty());
}

// What the model has of a second target is nothing that its pulses, and many frames, show beyond
// it. 180 ns behind the first, half of its pulses fall on those of the first.
TEST(BeyondModel, ASecondTargetIsNoFinding) {
  SceneOptions two;
  two.targets = 2;
  for (const double apart_m : {2.5, 180 * half_c_m_per_ns, 189 * half_c_m_per_ns + 0.04}) {
    const test::FrameMaker first = beyond_scene();
    const test::FrameMaker second = first.beside(apart_m, 0.2, 0.8);
    FrameEstimator estimator = beyond_estimator(first, two);
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      const Estimate e = estimator.estimate(first.make_with({second}, seed).view());
      EXPECT_EQ(e.target_count, 2U) << apart_m << " " << seed;
      for (const FoundList& list : {e.findings, e.targets[1].findings, e.recent_findings}) {
        for (const Finding& finding : list.all()) {
          ADD_FAILURE() << apart_m << " " << seed << " " << checks::to_string(finding.name) << " "
                        << finding.value << " " << finding.gain_nats;
        }
      }
    }
  }
}

// Two as bright before such a detector: of each the dead time hides the light that the other one's
// pulses come before.
TEST(BeyondModel, TwoBrightTargetsBeforeADetectorWithDeadTimeAreInTheModel) {
  SceneOptions two;
  two.targets = 2;
  for (const auto& [dead_ns, apart_m] : {std::pair{20.0, 2.5}, {20.0, 0.3}, {50.0, 9.0}}) {
    test::FrameMaker first = beyond_scene();
    first.pattern = test::random_pattern(3780000, 40, 9000, 3);
    first.length_ms = 10;
    first.signal_per_pulse = 0.3;
    const test::FrameMaker second = first.beside(apart_m, 0, 0.6);
    test::FrameMaker detector = first;
    detector.dead_time_ns = dead_ns;
    FrameEstimator estimator(first.pattern, {}, two, {}, first.length_ms, 200000,
                             ClockReference::tagger, {.dead_time_ns = dead_ns});
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      auto frame = first.make_with({second}, seed);
      std::mt19937_64 random(seed);
      detector.blind(frame, random);
      const Estimate e = estimator.estimate(frame.view());
      EXPECT_EQ(e.target_count, 2U) << dead_ns << " " << apart_m << " " << seed;
      for (const FoundList& list : {e.findings, e.targets[1].findings, e.recent_findings}) {
        for (const Finding& finding : list.all()) {
          ADD_FAILURE() << dead_ns << " " << apart_m << " " << seed << " "
                        << checks::to_string(finding.name) << " " << finding.value << " "
                        << finding.gain_nats;
        }
      }
    }
  }
}

// A brighter wall, a period of the comb behind the followed one: half of its pulses fall on the old
// place.
TEST(BeyondModel, AFollowedTargetIsLeftWhereTheBeamStepsByAPeriodOfTheComb) {
  test::FrameMaker near = beyond_scene();
  near.velocity_mps = 0;
  FrameEstimator estimator = beyond_estimator(near);
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    TargetTrack track;
    for (int n = 0; n < 3; ++n) {
      near.start_ps = 50'000'000'000LL * n;
      estimator.estimate(near.make(seed + 100 * static_cast<std::uint64_t>(n)).view(), &track);
    }
    test::FrameMaker far = near;
    far.start_ps = 150'000'000'000LL;
    far.distance_m += 180 * half_c_m_per_ns;
    far.signal_per_pulse *= 3;
    const Estimate e = estimator.estimate(far.make(seed).view(), &track);
    EXPECT_EQ(e.status, FrameStatus::ok) << seed;
    EXPECT_FALSE(is_far(e, far)) << seed;
  }
}

}  // namespace
}  // namespace splid
