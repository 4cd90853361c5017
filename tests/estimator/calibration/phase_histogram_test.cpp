#include "estimator/calibration/phase_histogram.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "tests/support/frame_maker.hpp"

namespace splid::calibration {
namespace {

test::FrameMaker drifting() {
  test::FrameMaker made;
  made.pattern = test::periodic_pattern(100000);
  made.drift_ppm = 50;
  made.distance_m = 3;
  made.signal_per_pulse = 0.02;
  made.background_per_ns = 0;
  made.length_ms = 5;
  return made;
}

TEST(PhaseHistogram, FoldsOnTheMeasuredPeriod) {
  test::FrameMaker made = drifting();
  PhaseHistogram fold(100000, 100);
  for (int n = 0; n < 2; ++n) {
    fold.add(made.make(static_cast<std::uint64_t>(n)).view());
    made.start_ps += 5'000'250'000;
  }
  EXPECT_NEAR(fold.period().period_ps, 100005, 1e-6);
  EXPECT_EQ(fold.bins(), 32000U);
  EXPECT_NEAR(fold.bin_ps(), 100005.0 / 32000, 1e-9);
  EXPECT_NEAR(fold.seconds(), 0.0100005, 1e-6);
  const auto& counts = fold.counts();
  ASSERT_EQ(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}), fold.photons());
  double moment = 0;
  for (std::size_t b = 0; b < counts.size(); ++b) {
    moment += counts[b] * (static_cast<double>(b) + 0.5) * fold.bin_ps();
  }
  // 2,000 photons of 100 ps: 2.2 ps.
  EXPECT_NEAR(moment / static_cast<double>(fold.photons()), 6 / 0.299792458 * 1e3, 9);
}

// A rate that changes within the frame moves its ends by the curvature; a photon there is at phase
// 0 of the curved clock.
TEST(PhaseHistogram, FollowsACurvedClock) {
  FrameView view{0, 2'000'000'000, {}, {}, {}};
  view.sync.locked = true;
  view.sync.origin_ps = 1'000'000'000;
  view.sync.period_ps = 100000;
  view.sync.curvature_ps = 3000;
  view.sync.curvature_zero = 1.0 / 3;
  const FramePhase phase(view);
  EXPECT_NEAR(phase.turn_of(2'000'002'000 + 25'000), 0.25, 1e-5);
  EXPECT_NEAR(phase.turn_of(2'000 + 25'000), 0.25, 1e-5);
  EXPECT_NEAR(phase.turn_of(1'000'000'000 - 1'000 + 25'000), 0.25, 1e-5);
}

TEST(PhaseHistogram, PassesOverFramesWithoutSyncAndLeavesOutLosses) {
  auto frame = drifting().make(1);
  PhaseHistogram fold(100000, 100);
  frame.sync.locked = false;
  fold.add(frame.view());
  EXPECT_EQ(fold.photons(), 0U);
  EXPECT_EQ(fold.period().period_ps, 0);
  frame.sync.locked = true;
  frame.losses = {{1'000'000'000, 2'000'000'000, 0}};
  fold.add(frame.view());
  EXPECT_NEAR(fold.seconds(), 0.00400025, 1e-6);
  EXPECT_EQ(fold.wrapped(-1), fold.bins() - 1);
  EXPECT_EQ(fold.wrapped(static_cast<std::ptrdiff_t>(fold.bins())), 0U);
}

}  // namespace
}  // namespace splid::calibration
