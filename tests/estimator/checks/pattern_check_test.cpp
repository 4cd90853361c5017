#include "estimator/checks/pattern_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

test::FrameMaker pattern_scene() {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.velocity_mps = 30;
  return made;
}

// Frames in which a misfit is seen, and its mean.
struct Seen {
  int frames = 0;
  double misfit = 0;
};

Seen look(const test::FrameMaker& made, const Pattern& believed, int frames) {
  FrameEstimator estimator(believed, {}, {}, {}, made.length_ms, 400'000);
  Seen seen;
  for (int n = 0; n < frames; ++n) {
    const auto frame = made.make(static_cast<std::uint64_t>(n));
    const Estimate e = estimator.estimate(frame.view());
    EXPECT_EQ(e.status, FrameStatus::ok);
    if (!e.amplitude_misfit) continue;
    ++seen.frames;
    seen.misfit += *e.amplitude_misfit;
  }
  if (seen.frames > 0) seen.misfit /= seen.frames;
  return seen;
}

Pattern uneven(Pattern pattern, double rms) {
  std::vector<double>& amplitudes = pattern.segments.front().amplitudes;
  for (std::size_t p = 0; p < amplitudes.size(); ++p) amplitudes[p] = 1 + (p % 2 ? rms : -rms);
  return pattern;
}

TEST(PatternCheck, SaysNothingWhereThePatternIsRight) {
  EXPECT_EQ(look(pattern_scene(), pattern_scene().pattern, 100).frames, 0);
  test::FrameMaker made = pattern_scene();
  made.pattern = uneven(made.pattern, 0.6);
  EXPECT_EQ(look(made, made.pattern, 50).frames, 0);
}

// Of pulses 9 ns apart the first hides the second from a detector that is blind for 50 ns.
TEST(PatternCheck, KnowsThatABlindDetectorMissesPulses) {
  for (const bool is_uneven : {false, true}) {
    test::FrameMaker made = pattern_scene();
    if (is_uneven) made.pattern = uneven(made.pattern, 0.5);
    made.length_ms = 2;
    made.signal_per_pulse = 1.5;
    made.dead_time_ns = 50;
    const auto frame = made.make(1);
    FrameEstimator modelled(made.pattern, {}, {}, {}, made.length_ms, 100'000,
                            ClockReference::tagger, {50});
    const Estimate e = modelled.estimate(frame.view());
    EXPECT_EQ(e.status, FrameStatus::ok);
    EXPECT_EQ(e.amplitude_misfit, std::nullopt);
    FrameEstimator left_out(made.pattern, {}, {}, {}, made.length_ms, 100'000);
    EXPECT_NE(left_out.estimate(frame.view()).amplitude_misfit, std::nullopt);
  }
}

// Frames of which a part of the photons is looked at: where a tenth of the time is left in which
// the detector is alive, and where it sees each pulse of forty in nearly each period.
TEST(PatternCheck, KnowsABlindDetectorInFramesOfVeryManyPhotons) {
  test::FrameMaker mostly_blind = pattern_scene();
  mostly_blind.length_ms = 10;
  mostly_blind.signal_per_pulse = 3;
  mostly_blind.background_per_ns = 0.06;
  mostly_blind.dead_time_ns = 50;
  test::FrameMaker regular = pattern_scene();
  regular.pattern = test::random_pattern(3780000, 40, 9000, 5);
  regular.length_ms = 10;
  regular.signal_per_pulse = 9;
  regular.background_per_ns = 1e-6;
  regular.dead_time_ns = 5;
  for (const test::FrameMaker& made : {mostly_blind, regular}) {
    FrameEstimator estimator(made.pattern, {}, {}, {}, made.length_ms, 400'000,
                             ClockReference::tagger, {made.dead_time_ns});
    for (std::uint64_t seed = 0; seed < 15; ++seed) {
      const auto frame = made.make(seed);
      EXPECT_GT(frame.photons_ps.size(), 100'000U);
      const Estimate e = estimator.estimate(frame.view());
      EXPECT_EQ(e.status, FrameStatus::ok);
      EXPECT_EQ(e.amplitude_misfit, std::nullopt);
    }
  }
}

TEST(PatternCheck, NoticesUnevenPulsesTakenForEvenOnes) {
  test::FrameMaker made = pattern_scene();
  const Pattern even = made.pattern;
  made.pattern = uneven(even, 0.6);
  const Seen seen = look(made, even, 50);
  EXPECT_EQ(seen.frames, 50);
  EXPECT_NEAR(seen.misfit, 0.6, 0.03);
}

// So many photons that a part of them is looked at: smaller differences show.
TEST(PatternCheck, NoticesSmallerOnesInBrightFrames) {
  test::FrameMaker made = pattern_scene();
  const Pattern even = made.pattern;
  made.signal_per_pulse = 0.3;
  made.pattern = uneven(even, 0.15);
  const Seen seen = look(made, even, 3);
  EXPECT_EQ(seen.frames, 3);
  EXPECT_NEAR(seen.misfit, 0.15, 0.02);
  EXPECT_EQ(look(made, made.pattern, 3).frames, 0);
}

// Frames of a scene that are not told apart from good ones, of those that show a target.
int frames_believed(const test::FrameMaker& made, const Pattern& believed, int frames) {
  FrameEstimator estimator(believed, {}, {}, {}, made.length_ms, 400'000);
  int valid = 0;
  for (int n = 0; n < frames; ++n) {
    const auto frame = made.make(static_cast<std::uint64_t>(n));
    const Estimate e = estimator.estimate(frame.view());
    EXPECT_TRUE(e.pattern_fault == PatternFault::none || e.status == FrameStatus::no_target);
    valid += e.status == FrameStatus::no_target ? 0 : 1;
  }
  return valid;
}

TEST(PatternCheck, BelievesNoFrameOfAnotherPatternOfTheSamePeriod) {
  const Pattern played = pattern_scene().pattern;
  const Pattern random = test::random_pattern(3780000, 40, 9000, 5);
  const Pattern baseline = test::periodic_pattern(3780000);
  const std::pair<Pattern, Pattern> pairs[] = {
      {played, random},
      {played, baseline},
      {random, played},
      {random, baseline},
      {random, test::random_pattern(3780000, 40, 9000, 6)}};
  for (const double signal : {13.5e-4, 4e-3, 0.03}) {
    for (const auto& [made, believed] : pairs) {
      test::FrameMaker scene = pattern_scene();
      scene.pattern = made;
      scene.signal_per_pulse = signal;
      // In the weakest, a line of chance through other light may look like any target's.
      EXPECT_LE(frames_believed(scene, believed, 10), signal < 2e-3 ? 1 : 0)
          << to_string(made.mode) << " as " << to_string(believed.mode) << ", S = " << signal;
    }
  }
}

// Each stretch of the one has its light at twenty phases of the other's period.
TEST(PatternCheck, BelievesNoFrameOfStretchesInAnotherOrder) {
  test::FrameMaker scene = pattern_scene();
  scene.signal_per_pulse = 0.01;
  scene.pattern = test::mrr_pattern({180000, 189000}, 3780000, 2e9);
  Pattern turned = test::mrr_pattern({189000, 180000}, 3780000, 2e9);
  const double apart_ps = pattern_period_ps(scene.pattern) - pattern_period_ps(turned);
  ASSERT_LT(std::abs(apart_ps), 1);
  EXPECT_EQ(frames_believed(scene, scene.pattern, 10), 10);
  EXPECT_EQ(frames_believed(scene, turned, 10), 0);
}

// Whatever the light: of 19 photons of signal, of very many, half of it missing in losses, with
// pulses of other amplitudes, and with a second target.
TEST(PatternCheck, BelievesThePatternThatWasPlayed) {
  const Pattern baseline = test::periodic_pattern(3780000);
  for (const Pattern& played : {pattern_scene().pattern, test::random_pattern(3780000, 40, 9000, 5),
                                baseline, test::mrr_pattern({180000, 189000}, 3780000, 2e9)}) {
    const double pulses = played.mode == Mode::baseline ? 40 : 1;
    for (const double signal : {2e-4, 13.5e-4, 0.2}) {
      test::FrameMaker scene = pattern_scene();
      scene.pattern = played;
      scene.signal_per_pulse = signal * pulses;
      const int frames = signal == 0.2 ? 3 : 30;
      EXPECT_EQ(frames_believed(scene, played, frames), frames)
          << to_string(played.mode) << ", S = " << signal;
    }
    test::FrameMaker few = pattern_scene();
    few.pattern = played;
    few.length_ms = 1;
    few.signal_per_pulse = 30 * pulses * 94.5 / 1e6;
    few.background_per_ns = 1e-7;
    EXPECT_EQ(frames_believed(few, played, 100), 100) << to_string(played.mode);
  }
}

TEST(PatternCheck, BelievesAFrameOfWhichHalfWasSeen) {
  const test::FrameMaker scene = pattern_scene();
  FrameEstimator estimator(scene.pattern, {}, {}, {}, scene.length_ms, 400'000);
  for (std::uint64_t n = 0; n < 10; ++n) {
    auto frame = scene.make(n);
    const std::int64_t length_ps = frame.end_ps - frame.start_ps;
    const auto lost = [&](std::int64_t time_ps) {
      return (time_ps - frame.start_ps) * 10 / length_ps % 2 == 1;
    };
    std::erase_if(frame.photons_ps, lost);
    for (std::int64_t k = 1; k < 10; k += 2) {
      frame.losses.push_back(
          {frame.start_ps + length_ps * k / 10, frame.start_ps + length_ps * (k + 1) / 10, 0});
    }
    EXPECT_EQ(estimator.estimate(frame.view()).status, FrameStatus::ok);
  }
}

// Three more targets as bright, or less bright ones in any number, leave the best one's frame.
TEST(PatternCheck, BelievesOneOfTwoTargets) {
  test::FrameMaker scene = pattern_scene();
  scene.pattern = test::periodic_pattern(3780000);
  scene.signal_per_pulse = 0.05;
  test::FrameMaker other = scene;
  other.distance_m = 301;
  other.background_per_ns = 0;
  FrameEstimator estimator(scene.pattern, {}, {}, {}, scene.length_ms, 400'000);
  for (std::uint64_t n = 0; n < 10; ++n) {
    auto frame = scene.make(n);
    const auto more = other.make(n + 100).photons_ps;
    frame.photons_ps.insert(frame.photons_ps.end(), more.begin(), more.end());
    std::sort(frame.photons_ps.begin(), frame.photons_ps.end());
    EXPECT_EQ(estimator.estimate(frame.view()).pattern_fault, PatternFault::none);
  }
}

TEST(PatternCheck, HasNothingToCompareInAnEvenTrain) {
  test::FrameMaker made = pattern_scene();
  made.pattern = test::periodic_pattern(94500);
  EXPECT_EQ(look(made, made.pattern, 3).frames, 0);
}

}  // namespace
}  // namespace splid
