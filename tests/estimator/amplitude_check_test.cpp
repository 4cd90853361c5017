#include "estimator/amplitude_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

test::FrameMaker paper_scene() {
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

TEST(AmplitudeCheck, SaysNothingWhereThePatternIsRight) {
  EXPECT_EQ(look(paper_scene(), paper_scene().pattern, 100).frames, 0);
  test::FrameMaker made = paper_scene();
  made.pattern = uneven(made.pattern, 0.6);
  EXPECT_EQ(look(made, made.pattern, 50).frames, 0);
}

TEST(AmplitudeCheck, NoticesUnevenPulsesTakenForEvenOnes) {
  test::FrameMaker made = paper_scene();
  const Pattern even = made.pattern;
  made.pattern = uneven(even, 0.6);
  const Seen seen = look(made, even, 50);
  EXPECT_EQ(seen.frames, 50);
  EXPECT_NEAR(seen.misfit, 0.6, 0.03);
}

// So many photons that a part of them is looked at: smaller differences show.
TEST(AmplitudeCheck, NoticesSmallerOnesInBrightFrames) {
  test::FrameMaker made = paper_scene();
  const Pattern even = made.pattern;
  made.signal_per_pulse = 0.3;
  made.pattern = uneven(even, 0.15);
  const Seen seen = look(made, even, 3);
  EXPECT_EQ(seen.frames, 3);
  EXPECT_NEAR(seen.misfit, 0.15, 0.02);
  EXPECT_EQ(look(made, made.pattern, 3).frames, 0);
}

TEST(AmplitudeCheck, HasNothingToCompareInAnEvenTrain) {
  test::FrameMaker made = paper_scene();
  made.pattern = test::periodic_pattern(94500);
  EXPECT_EQ(look(made, made.pattern, 3).frames, 0);
}

}  // namespace
}  // namespace splid
