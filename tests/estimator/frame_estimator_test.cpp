#include "estimator/frame_estimator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "protocol/error.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/frame_maker.hpp"
#include "tests/support/sanitized.hpp"

namespace splid {
namespace {

constexpr double estimator_c_m_per_ns = 0.299792458;

test::FrameMaker paper_scene() {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  return made;
}

FrameEstimator estimator_for(const test::FrameMaker& made, const SceneOptions& scene = {},
                             const EstimatorOptions& options = {}) {
  PulseOptions pulse;
  pulse.sigma_ps = made.sigma_ns * 1e3;
  return {made.pattern, pulse, scene, options, made.length_ms, 200000};
}

double delay_error(const Estimate& estimate, const test::FrameMaker& made) {
  const double period = made.pattern.segments.front().period_ps * 1e-3;
  return std::remainder(estimate.delay_ns - 2 * made.distance_m / estimator_c_m_per_ns, period);
}

void expect_all_finite(const Estimate& e) {
  for (const double value :
       {e.delay_ns, e.delay_start_ns, e.velocity_mps, e.signal_per_pulse, e.background_per_ns,
        e.std_delay_ns, e.std_velocity_mps, e.std_signal_per_pulse, e.std_background_per_ns,
        e.significance_nats, e.threshold_nats}) {
    EXPECT_TRUE(std::isfinite(value));
  }
}

// One of the two oscillators is 100 ppm off, which is 190 ps of delay and 28.5 mm, 46 deviations of
// a frame. Distances are right in the clock of the other oscillator, and off by just that in the
// clock of this oscillator. The velocity is right in both: 100 ppm of the velocity would be 1.5
// cm/s, a third of its deviation, and of the pattern's drift 15 km/s.
TEST(FrameEstimator, DelaysAreInTheClockThatIsTakenToBeRight) {
  constexpr int frames = 40;
  for (const bool tagger_is_off : {false, true}) {
    test::FrameMaker made = paper_scene();
    made.velocity_mps = 140;
    made.drift_ppm = 100;  // in either case the tagger counts more in a period than it should
    made.tagger_ppm = tagger_is_off ? 100 : 0;
    for (const ClockReference reference : {ClockReference::tagger, ClockReference::pattern}) {
      FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, 200'000, reference);
      double off_ns = 0, off_mps = 0, variance = 0, velocity_variance = 0;
      for (int n = 0; n < frames; ++n) {
        const auto frame = made.make(static_cast<std::uint64_t>(n));
        const Estimate estimate = estimator.estimate(frame.view());
        ASSERT_EQ(estimate.status, FrameStatus::ok);
        off_ns += delay_error(estimate, made) / frames;
        off_mps += (estimate.velocity_mps - made.velocity_mps) / frames;
        variance += std::pow(estimate.std_delay_ns / frames, 2);
        velocity_variance += std::pow(estimate.std_velocity_mps / frames, 2);
      }
      const bool trusts_the_wrong = tagger_is_off == (reference == ClockReference::tagger);
      const double way_ns = 2 * made.distance_m / estimator_c_m_per_ns;
      const double wrong_ns = tagger_is_off ? 1e-4 * way_ns : -1e-4 * way_ns;
      EXPECT_NEAR(off_ns, trusts_the_wrong ? wrong_ns : 0, 4 * std::sqrt(variance));
      EXPECT_NEAR(off_mps, 0, 4 * std::sqrt(velocity_variance));
    }
  }
}

// 120 frames a pattern: the rms of 120 normal errors over their deviation is 1 within 0.2 (3
// sigma).
// Of frames that tell a spread, a sanitizer's build computes each tenth, over the same range: the
// bound is wider by the root of that, and the release build looks at all.
#ifdef SPLID_SANITIZED
constexpr int spread_step = 10;
#else
constexpr int spread_step = 1;
#endif

TEST(FrameEstimator, ErrorsAreWhatTheDeviationsSay) {
  const Pattern patterns[] = {test::interleaved_pattern({180000, 189000}, 3780000),
                              test::random_pattern(3780000, 40, 9000, 5),
                              test::periodic_pattern(3780000)};
  for (const Pattern& pattern : patterns) {
    test::FrameMaker made;
    made.pattern = pattern;
    if (pattern.mode == Mode::baseline) made.signal_per_pulse = 0.02;  // one pulse, not forty
    FrameEstimator estimator = estimator_for(made);
    double delay = 0, velocity = 0, signal = 0, background = 0;
    const int frames = 120 / spread_step;
    for (int n = 0; n < 120; n += spread_step) {
      made.velocity_mps = -150 + 2.5 * n;
      made.distance_m = 284.5 + 0.0137 * n;
      const auto frame = made.make(static_cast<std::uint64_t>(n));
      const Estimate e = estimator.estimate(frame.view());
      ASSERT_EQ(e.status, FrameStatus::ok) << n;
      ASSERT_LT(std::abs(delay_error(e, made)), 6 * e.std_delay_ns) << n;
      delay += std::pow(delay_error(e, made) / e.std_delay_ns, 2);
      velocity += std::pow((e.velocity_mps - made.velocity_mps) / e.std_velocity_mps, 2);
      signal += std::pow((e.signal_per_pulse - made.signal_per_pulse) / e.std_signal_per_pulse, 2);
      background +=
          std::pow((e.background_per_ns - made.background_per_ns) / e.std_background_per_ns, 2);
    }
    for (const double sum : {delay, velocity, signal, background}) {
      EXPECT_NEAR(std::sqrt(sum / frames), 1, 0.2 * std::sqrt(spread_step))
          << to_string(pattern.mode);
    }
  }
}

// Segments of half a frame, of 1 ms and of four circles of delays, in which most photons may have
// left in either of two; and periods that do not fit the circle, so that every photon is one of
// those. 100 frames each: rms over deviation 1 within 0.25 (3.5 sigma, for 15 of them).
TEST(FrameEstimator, MeasuresMovingTargetsWithRatesInTurn) {
  const Pattern patterns[] = {
      test::mrr_pattern({180000, 189000}, 3780000, 50e9),
      test::mrr_pattern({180000, 189000}, 3780000, 2e9),
      test::mrr_pattern({180000, 189000}, 3780000, 30e6),
      test::mrr_pattern({180000, 189000, 210000}, 3780000, 3e9),
      test::mrr_pattern({180000, 189013}, 3780000, 2e9),
  };
  for (const Pattern& pattern : patterns) {
    test::FrameMaker made;
    made.pattern = pattern;
    made.length_ms = pattern_period_ps(pattern) > 10e9 ? 50 : 20;
    made.signal_per_pulse = 4e-3;
    FrameEstimator estimator = estimator_for(made);
    double delay = 0, velocity = 0, signal = 0;
    const int frames = 100 / spread_step;
    for (int n = 0; n < 100; n += spread_step) {
      made.velocity_mps = -150 + 3 * n;
      made.distance_m = 5 + 5.6 * n;  // over the circle of 566.6 m
      const auto frame = made.make(static_cast<std::uint64_t>(1000 + n));
      const Estimate e = estimator.estimate(frame.view());
      const double error =
          std::remainder(e.delay_ns - 2 * made.distance_m / estimator_c_m_per_ns, 3780);
      ASSERT_EQ(e.status, FrameStatus::ok) << n;
      ASSERT_LT(std::abs(error), 6 * e.std_delay_ns) << n << " of " << pattern_period_ps(pattern);
      delay += std::pow(error / e.std_delay_ns, 2);
      velocity += std::pow((e.velocity_mps - made.velocity_mps) / e.std_velocity_mps, 2);
      signal += std::pow((e.signal_per_pulse - made.signal_per_pulse) / e.std_signal_per_pulse, 2);
    }
    for (const double sum : {delay, velocity, signal}) {
      EXPECT_NEAR(std::sqrt(sum / frames), 1, 0.25 * std::sqrt(spread_step))
          << pattern_period_ps(pattern);
    }
  }
}

// A scene said to be at rest: what moves so slowly that it cannot be told is measured, what moves
// faster is not passed off as at rest.
TEST(FrameEstimator, AStaticScenesMovingTargetIsNoticed) {
  test::FrameMaker made = paper_scene();
  FrameEstimator estimator = estimator_for(made, {.motion = Motion::static_target});
  for (const double velocity : {0.0, 0.02, -0.3, 1.0, -10.0, 150.0}) {
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      made.velocity_mps = velocity;
      const auto frame = made.make(seed);
      const Estimate e = estimator.estimate(frame.view());
      if (std::abs(velocity) < 0.1) {
        ASSERT_EQ(e.status, FrameStatus::ok) << velocity;
        EXPECT_LT(std::abs(delay_error(e, made)), 5 * e.std_delay_ns);
      } else {
        EXPECT_EQ(e.status, FrameStatus::no_target) << velocity;
        EXPECT_FALSE(e.has_values);
      }
    }
  }
}

// A target that stops and goes: followed from frame to frame with the same result as a search.
TEST(FrameEstimator, AFollowedTargetIsWhereASearchFindsIt) {
  test::FrameMaker made = paper_scene();
  FrameEstimator estimator = estimator_for(made);
  TargetTrack track;
  int followed = 0;
  for (int n = 0; n < 60; ++n) {
    const double t_s = 0.05 * n;
    made.start_ps = static_cast<std::int64_t>(n) * 50'000'000'000;
    made.velocity_mps = 3 * std::sin(3 * t_s);
    made.distance_m = 284.5 - std::cos(3 * t_s);
    if (n == 40) made.distance_m = 100;  // another target altogether
    const auto frame = made.make(static_cast<std::uint64_t>(n));
    const Estimate searched = estimator.estimate(frame.view());
    const Estimate tracked = estimator.estimate(frame.view(), &track);
    followed += track.followed > 0 ? 1 : 0;
    ASSERT_EQ(tracked.status, FrameStatus::ok) << n;
    EXPECT_NEAR(tracked.delay_ns, searched.delay_ns, 1e-3 * searched.std_delay_ns) << n;
    EXPECT_NEAR(tracked.velocity_mps, searched.velocity_mps, 1e-3 * searched.std_velocity_mps);
  }
  EXPECT_GE(followed, 50);
  EXPECT_LE(followed, 56);
}

TEST(FrameEstimator, ALostTrackIsSearchedFor) {
  test::FrameMaker made = paper_scene();
  FrameEstimator estimator = estimator_for(made);
  TargetTrack track;
  const auto first = made.make(1);
  estimator.estimate(first.view(), &track);
  ASSERT_TRUE(track.valid);
  made.signal_per_pulse = 0;
  made.start_ps = 50'000'000'000;
  const auto dark = made.make(2);
  EXPECT_EQ(estimator.estimate(dark.view(), &track).status, FrameStatus::no_target);
  made.signal_per_pulse = 13.5e-4;
  made.start_ps = 100'000'000'000;
  const auto again = made.make(3);
  EXPECT_EQ(estimator.estimate(again.view(), &track).status, FrameStatus::ok);
  EXPECT_EQ(track.followed, 1);
}

// [P]'s method through the same door: the same maximum, judged by the same likelihood.
TEST(FrameEstimator, MethodPaperGivesTheSameTarget) {
  test::FrameMaker made = paper_scene();
  made.velocity_mps = -140;
  const auto frame = made.make(3);
  EstimatorOptions paper;
  paper.method = Method::paper;
  const Estimate by_paper = estimator_for(made, {}, paper).estimate(frame.view());
  const Estimate by_search = estimator_for(made).estimate(frame.view());
  ASSERT_EQ(by_paper.status, FrameStatus::ok);
  EXPECT_NEAR(by_paper.delay_ns, by_search.delay_ns, 0.01 * by_search.std_delay_ns);
  EXPECT_NEAR(by_paper.std_delay_ns, by_search.std_delay_ns, 0.01 * by_search.std_delay_ns);
  EXPECT_NEAR(by_paper.std_velocity_mps, by_search.std_velocity_mps,
              0.01 * by_search.std_velocity_mps);
  EXPECT_NEAR(by_paper.significance_nats, by_search.significance_nats, 1e-3);
}

TEST(FrameEstimator, GivesTheDelayAtTheFramesStartToo) {
  test::FrameMaker made = paper_scene();
  made.velocity_mps = 100;
  const auto frame = made.make(1);
  const Estimate e = estimator_for(made).estimate(frame.view());
  const double half_ns = static_cast<double>(frame.end_ps - frame.start_ps) * 0.5e-3;
  // tau = 2 z / c: half a frame earlier the target was v t_a / 2 nearer.
  EXPECT_NEAR(e.delay_ns - e.delay_start_ns,
              2 * e.velocity_mps * half_ns * 1e-9 / estimator_c_m_per_ns, 1e-9);
}

TEST(FrameEstimator, TheSameFrameGivesTheSameBits) {
  test::FrameMaker made = paper_scene();
  FrameEstimator one = estimator_for(made);
  FrameEstimator other = estimator_for(made);
  const auto frame = made.make(1);
  const auto another = made.make(2);
  const Estimate first = one.estimate(frame.view());
  other.estimate(another.view());  // whatever came before
  const Estimate second = other.estimate(frame.view());
  EXPECT_EQ(std::bit_cast<std::uint64_t>(first.delay_ns),
            std::bit_cast<std::uint64_t>(second.delay_ns));
  EXPECT_EQ(std::bit_cast<std::uint64_t>(first.velocity_mps),
            std::bit_cast<std::uint64_t>(second.velocity_mps));
  EXPECT_EQ(std::bit_cast<std::uint64_t>(first.std_delay_ns),
            std::bit_cast<std::uint64_t>(second.std_delay_ns));
}

TEST(FrameEstimator, AnEpochMakesNoDifference) {
  test::FrameMaker made = paper_scene();
  FrameEstimator estimator = estimator_for(made);
  const Estimate at_zero = estimator.estimate(made.make(3).view());
  made.start_ps = 340000000000000000;
  const Estimate at_epoch = estimator.estimate(made.make(3).view());
  EXPECT_EQ(at_zero.delay_ns, at_epoch.delay_ns);
  EXPECT_EQ(at_zero.velocity_mps, at_epoch.velocity_mps);
}

TEST(FrameEstimator, FollowsADriftingClock) {
  for (const double ppm : {-100.0, 3.0, 100.0}) {
    test::FrameMaker made = paper_scene();
    made.drift_ppm = ppm;
    made.velocity_mps = 12;
    const Estimate e = estimator_for(made).estimate(made.make(5).view());
    ASSERT_EQ(e.status, FrameStatus::ok);
    EXPECT_LT(std::abs(delay_error(e, made)), 4 * e.std_delay_ns) << ppm;
    EXPECT_LT(std::abs(e.velocity_mps - 12), 4 * e.std_velocity_mps) << ppm;
  }
}

TEST(FrameEstimator, FindsATargetAtTheEndsOfTheRange) {
  for (const double delay_ns : {0.0, 0.05, 3779.97, 1890.0}) {
    test::FrameMaker made = paper_scene();
    made.distance_m = delay_ns * estimator_c_m_per_ns / 2;
    const Estimate e = estimator_for(made).estimate(made.make(6).view());
    ASSERT_EQ(e.status, FrameStatus::ok);
    EXPECT_LT(std::abs(delay_error(e, made)), 4 * e.std_delay_ns) << delay_ns;
    EXPECT_GE(e.delay_ns, 0);
    EXPECT_LT(e.delay_ns, 3780);
  }
}

TEST(FrameEstimator, FramesWithHardlyAnythingSayNoTarget) {
  test::FrameMaker made = paper_scene();
  FrameEstimator estimator = estimator_for(made);
  auto frame = made.make(1);
  const std::vector<std::int64_t> all = frame.photons_ps;
  for (const std::size_t count : {0, 1, 2, 3}) {
    frame.photons_ps.assign(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count));
    const Estimate e = estimator.estimate(frame.view());
    EXPECT_EQ(e.status, FrameStatus::no_target) << count;
    EXPECT_EQ(e.photons, count);
    expect_all_finite(e);
  }
}

TEST(FrameEstimator, AllPhotonsAtOneTimeAreNoException) {
  test::FrameMaker made = paper_scene();
  auto frame = made.make(1);
  std::fill(frame.photons_ps.begin(), frame.photons_ps.end(), frame.start_ps + 1234567);
  const Estimate e = estimator_for(made).estimate(frame.view());
  expect_all_finite(e);
}

// 10 ps of jitter at both ends of the frame: 4.2 cm/s that the photons know nothing of.
TEST(FrameEstimator, TheClocksOwnUncertaintyIsInTheDeviations) {
  test::FrameMaker made = paper_scene();
  auto frame = made.make(1);
  FrameEstimator estimator = estimator_for(made);
  const Estimate sharp = estimator.estimate(frame.view());
  frame.sync.std_period_ps = 10 * std::sqrt(2.0) / 13227;
  frame.sync.std_phase_ps = 3;
  const Estimate soft = estimator.estimate(frame.view());
  EXPECT_EQ(sharp.velocity_mps, soft.velocity_mps);
  EXPECT_NEAR(std::sqrt(std::pow(soft.std_velocity_mps, 2) - std::pow(sharp.std_velocity_mps, 2)),
              0.042, 0.001);
  EXPECT_NEAR(std::sqrt(std::pow(soft.std_delay_ns, 2) - std::pow(sharp.std_delay_ns, 2)), 0.003,
              1e-5);
}

TEST(FrameEstimator, WithoutSyncThereIsNoEstimate) {
  test::FrameMaker made = paper_scene();
  auto frame = made.make(1);
  frame.sync.locked = false;
  const Estimate e = estimator_for(made).estimate(frame.view());
  EXPECT_EQ(e.status, FrameStatus::no_sync);
  EXPECT_FALSE(e.has_values);
  EXPECT_NEAR(e.background_per_ns, 1.9e-4, 1e-5);  // all that was counted
}

TEST(FrameEstimator, ALossIsIntegratedOver) {
  test::FrameMaker made = paper_scene();
  auto frame = made.make(9);
  const std::int64_t length = frame.end_ps - frame.start_ps;
  frame.losses = {{frame.start_ps + length / 5, frame.start_ps + length / 2, -1}};
  std::erase_if(frame.photons_ps, [&](std::int64_t t) {
    return t >= frame.losses[0].begin_ps && t < frame.losses[0].end_ps;
  });
  const Estimate e = estimator_for(made).estimate(frame.view());
  ASSERT_EQ(e.status, FrameStatus::ok);
  EXPECT_LT(std::abs(e.signal_per_pulse - made.signal_per_pulse), 4 * e.std_signal_per_pulse);
  EXPECT_LT(std::abs(e.background_per_ns - made.background_per_ns), 4 * e.std_background_per_ns);
  EXPECT_LT(std::abs(delay_error(e, made)), 4 * e.std_delay_ns);
}

TEST(FrameEstimator, StaticAndAutoMotion) {
  test::FrameMaker made = paper_scene();
  SceneOptions scene;
  scene.motion = Motion::static_target;
  const Estimate still = estimator_for(made, scene).estimate(made.make(2).view());
  ASSERT_EQ(still.status, FrameStatus::ok);
  EXPECT_EQ(still.velocity_mps, 0);
  EXPECT_EQ(still.std_velocity_mps, 0);
  EXPECT_LT(std::abs(delay_error(still, made)), 4 * still.std_delay_ns);

  scene.motion = Motion::automatic;
  const Estimate rest = estimator_for(made, scene).estimate(made.make(2).view());
  EXPECT_EQ(rest.velocity_mps, 0);
  made.velocity_mps = 1;
  const Estimate moving = estimator_for(made, scene).estimate(made.make(2).view());
  EXPECT_NEAR(moving.velocity_mps, 1, 4 * moving.std_velocity_mps);
  EXPECT_GT(moving.std_velocity_mps, 0);
}

TEST(FrameEstimator, AmbiguousModeSaysSo) {
  test::FrameMaker made = paper_scene();
  made.pattern = test::periodic_pattern(94500);
  made.pattern.mode = Mode::ambiguous;
  const Estimate e = estimator_for(made).estimate(made.make(2).view());
  EXPECT_EQ(e.status, FrameStatus::ambiguous);
  EXPECT_LT(std::abs(delay_error(e, made)), 4 * e.std_delay_ns);
  EXPECT_LT(e.delay_ns, 94.5);
}

// Pulses even to within half their width: shifted by one of them, all but fits.
TEST(FrameEstimator, TellsNearlyEvenPulsesApart) {
  test::FrameMaker made = paper_scene();
  made.pattern = test::periodic_pattern(12512.6);
  made.pattern.mode = Mode::random;
  made.pattern.segments = {{12512.6, {1415, 4530, 7692, 10764}, {1, 1, 1, 1}, 0}};
  made.length_ms = 5;
  FrameEstimator estimator = estimator_for(made);
  for (int n = 0; n < 40; ++n) {
    made.distance_m = 0.047 * n;
    const Estimate e = estimator.estimate(made.make(static_cast<std::uint64_t>(n)).view());
    ASSERT_EQ(e.status, FrameStatus::ok);
    EXPECT_LT(std::abs(delay_error(e, made)), 5 * e.std_delay_ns) << n;
  }
}

TEST(FrameEstimator, UnequalAmplitudesAreUsed) {
  test::FrameMaker made = paper_scene();
  auto& amplitudes = made.pattern.segments.front().amplitudes;
  for (std::size_t p = 0; p < amplitudes.size(); ++p) amplitudes[p] = p % 3 == 0 ? 2 : 0.3;
  const Estimate e = estimator_for(made).estimate(made.make(2).view());
  ASSERT_EQ(e.status, FrameStatus::ok);
  EXPECT_LT(std::abs(delay_error(e, made)), 4 * e.std_delay_ns);
  EXPECT_LT(std::abs(e.signal_per_pulse - made.signal_per_pulse), 4 * e.std_signal_per_pulse);
}

// A tabulated gaussian, moved by 30 ps: the delay comes back without the move.
TEST(FrameEstimator, ATabulatedShapeReplacesTheGaussian) {
  test::FrameMaker made = paper_scene();
  TabulatedPulse table{-500, 20, {}};
  for (int i = 0; i <= 50; ++i) {
    const double t = (table.first_ps + 20 * i - 30) / 100;
    table.density.push_back(std::exp(-0.5 * t * t));
  }
  made.pattern.pulse = table;
  PulseOptions pulse;
  pulse.shape = Shape::tabulated;
  FrameEstimator estimator(made.pattern, pulse, {}, {}, made.length_ms, 200000);
  const Estimate e = estimator.estimate(made.make(2).view());
  ASSERT_EQ(e.status, FrameStatus::ok);
  EXPECT_LT(std::abs(delay_error(e, made) + 0.030), 4 * e.std_delay_ns);
}

TEST(FrameEstimator, RefusesWhatDoesNotFitTogether) {
  test::FrameMaker made = paper_scene();
  PulseOptions pulse;
  pulse.shape = Shape::tabulated;
  EXPECT_THROW(FrameEstimator(made.pattern, pulse, {}, {}, 50, 1000), Error);
}

TEST(FrameEstimator, OptionsThatDoNotGoTogetherAreRefusedByTheirPlace) {
  const auto error_of = [](const PulseOptions& pulse, const SceneOptions& scene,
                           const EstimatorOptions& options) {
    try {
      const FrameEstimator made(paper_scene().pattern, pulse, scene, options, 50, 1000);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  SceneOptions several;
  several.targets = 2;
  EXPECT_EQ(error_of({}, several, {}), "");
  EXPECT_THAT(error_of({}, several, {.method = Method::paper}),
              testing::StartsWith("/estimator/method: "));
  PulseOptions fitted;
  fitted.width = PulseWidth::fitted;
  EXPECT_EQ(error_of(fitted, several, {}), "");
  EXPECT_THAT(error_of(fitted, {}, {.method = Method::paper}),
              testing::StartsWith("/pulse/width: "));
}

// Bright and dark frames of a scene, each on its own and followed.
void expect_no_allocation(test::FrameMaker made, const EstimatorOptions& options = {},
                          Motion motion = Motion::moving, const DetectorOptions& detector = {}) {
  FrameEstimator estimator(made.pattern, {}, {.motion = motion}, options, made.length_ms, 400000,
                           ClockReference::tagger, detector);
  const auto bright = made.make(1);
  made.signal_per_pulse = 0;
  made.background_per_ns = 5e-4;
  const auto dark = made.make(2);
  TargetTrack track;
  const std::uint64_t before = test::allocations;
  for (TargetTrack* followed : {static_cast<TargetTrack*>(nullptr), &track, &track}) {
    EXPECT_EQ(estimator.estimate(bright.view(), followed).status, FrameStatus::ok);
    EXPECT_EQ(estimator.estimate(dark.view(), followed).status, FrameStatus::no_target);
  }
  EXPECT_EQ(test::allocations, before);
}

// As many losses as the framer keeps of a frame.
TEST(FrameEstimator, AllocatesNothingForManyLosses) {
  const test::FrameMaker made = paper_scene();
  auto frame = made.make(1);
  constexpr std::int64_t count = 256;
  const std::int64_t step_ps = (frame.end_ps - frame.start_ps) / count;
  for (std::int64_t k = 0; k < count; ++k) {
    const std::int64_t begin_ps = frame.start_ps + k * step_ps;
    frame.losses.push_back({begin_ps, begin_ps + step_ps / 20, 0});
  }
  std::erase_if(frame.photons_ps,
                [&](std::int64_t t) { return (t - frame.start_ps) % step_ps < step_ps / 20; });
  FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, 400000);
  const std::uint64_t before = test::allocations;
  EXPECT_EQ(estimator.estimate(frame.view()).status, FrameStatus::ok);
  EXPECT_EQ(test::allocations, before);
}

TEST(FrameEstimator, AllocatesNothingAfterConstruction) {
  test::FrameMaker made = paper_scene();
  expect_no_allocation(made);
  expect_no_allocation(made, {.effort = Effort::fast});
  made.pattern = test::random_pattern(3780000, 40, 9000, 5);
  expect_no_allocation(made);
  made.pattern = test::mrr_pattern({180000, 189000}, 3780000, 2 * 3780000);
  expect_no_allocation(made);
  made = paper_scene();
  for (const Motion motion : {Motion::automatic, Motion::accelerating}) {
    made.acceleration_mps2 = 0;
    expect_no_allocation(made, {}, motion);
    made.acceleration_mps2 = 100;
    expect_no_allocation(made, {}, motion);
  }
  // So many that they are sampled, and those near the pulses gathered.
  made = paper_scene();
  made.signal_per_pulse = 0.6;
  expect_no_allocation(made);
  made.dead_time_ns = 50;
  expect_no_allocation(made, {}, Motion::moving, {50});
  made.signal_per_pulse = 0.1;
  for (const Motion motion : {Motion::moving, Motion::accelerating}) {
    expect_no_allocation(made, {}, motion, {50});
  }
}

}  // namespace
}  // namespace splid
