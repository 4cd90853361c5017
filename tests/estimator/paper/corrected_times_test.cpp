#include "estimator/paper/corrected_times.hpp"

#include <gtest/gtest.h>

#include "tests/support/frame_maker.hpp"

namespace splid::paper {
namespace {

TEST(CorrectedTimes, PhaseIsTheTimeSinceThePatternStart) {
  test::FrameMaker::Frame frame;
  frame.start_ps = 340000000000000000;
  frame.end_ps = frame.start_ps + 10'000'000;
  frame.photons_ps = {frame.start_ps, frame.start_ps + 1'001'500, frame.start_ps + 9'999'999};
  // Pattern starts every 1.001 us of the tagger's clock, 1 us of the pattern's, one of them 400 ns
  // after the frame's start.
  frame.sync = {.locked = true,
                .origin_ps = frame.start_ps + 5'000'000,
                .phase_ps = 405'000,
                .period_ps = 1'001'000};
  const CorrectedTimes times(frame.view(), 1000);
  EXPECT_NEAR(times.scale, 1.001, 1e-12);
  EXPECT_NEAR(times.length_ns, 10000 / 1.001, 1e-9);
  EXPECT_NEAR(times.start_phase_ns, 1000 - 400 / 1.001, 1e-9);
  EXPECT_NEAR(times.phase_ns[0], times.start_phase_ns, 1e-12);
  EXPECT_NEAR(times.phase_ns[1], 1000 - 399.5 / 1.001, 1e-9);
  EXPECT_NEAR(times.time_ns[2], 9999.999 / 1.001, 1e-9);
}

TEST(CorrectedTimes, LossesAreNotSeen) {
  test::FrameMaker::Frame frame;
  frame.start_ps = 1000;
  frame.end_ps = 1'001'000;
  frame.losses = {{1000, 101'000, 5}, {501'000, 601'000, 5}, {901'000, 1'001'000, 5}};
  frame.sync = {.locked = true, .origin_ps = 1000, .period_ps = 100'000};
  const CorrectedTimes times(frame.view(), 100);
  ASSERT_EQ(times.seen.size(), 2U);
  EXPECT_NEAR(times.seen[0].begin_ns, 100, 1e-9);
  EXPECT_NEAR(times.seen[0].end_ns, 500, 1e-9);
  EXPECT_NEAR(times.seen[1].begin_ns, 600, 1e-9);
  EXPECT_NEAR(times.seen[1].end_ns, 900, 1e-9);
  EXPECT_NEAR(times.seen_ns, 700, 1e-9);
}

}  // namespace
}  // namespace splid::paper
