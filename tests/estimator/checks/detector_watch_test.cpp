#include "estimator/checks/detector_watch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "estimator/frame_estimator.hpp"
#include "protocol/pattern_make.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid::checks {
namespace {

test::FrameMaker target() {
  test::FrameMaker made;
  made.pattern = make_interleaved(std::vector<double>{180'000, 189'000});
  made.signal_per_pulse = 0.05;
  made.velocity_mps = 10;
  made.dead_time_ns = 50;
  return made;
}

// By how much a detection after a wait is late in these tests: 150 ps after 50 ns, none from 200
// on.
double late_ps(double wait_ns) { return std::max(0.0, 200 - wait_ns); }

DetectorWatch watched(double most_late, std::size_t inputs = 1, int frames = 21) {
  const test::FrameMaker made = target();
  const DetectorOptions detector = {made.dead_time_ns};
  DetectorWatch watch(made.pattern, {}, detector, ClockReference::tagger, inputs);
  FrameEstimator estimator(made.pattern, {}, {}, {}, 50, 1 << 17, ClockReference::tagger, detector);
  for (int n = 0; n < frames; ++n) {
    auto frame = made.make(static_cast<std::uint64_t>(n));
    std::sort(frame.photons_ps.begin(), frame.photons_ps.end());
    for (std::size_t i = frame.photons_ps.size(); i-- > 1;) {
      const auto wait_ps = static_cast<double>(frame.photons_ps[i] - frame.photons_ps[i - 1]);
      frame.photons_ps[i] += std::llround(most_late * late_ps(wait_ps * 1e-3));
    }
    watch.add(frame.view(), estimator.estimate(frame.view()));
  }
  return watch;
}

TEST(DetectorWatch, TimingWalkIsFoundWithItsTable) {
  const DetectorWatch watch = watched(1);
  const FoundList found = watch.found();
  ASSERT_EQ(found.all().size(), 1U);
  const Finding& walk = found.all().front();
  EXPECT_EQ(walk.name, FindingName::timing_walk);
  EXPECT_GT(walk.value, 80);
  EXPECT_LT(walk.value, 155);
  EXPECT_GT(walk.gain_nats, 100);
  const auto table = watch.walk();
  ASSERT_GE(table.size(), 3U);
  for (const NumberPair& row : table) EXPECT_NEAR(row[1], late_ps(row[0]), 12) << row[0];
  for (std::size_t i = 1; i < table.size(); ++i) EXPECT_GT(table[i][0], table[i - 1][0]);
}

TEST(DetectorWatch, ARightDetectorHasNone) { EXPECT_TRUE(watched(0).found().all().empty()); }

TEST(DetectorWatch, SaysNothingBeforeASecondIsOverOrOfSeveralInputs) {
  EXPECT_TRUE(watched(1, 1, 19).found().all().empty());
  EXPECT_TRUE(watched(1, 2).found().all().empty());
}

}  // namespace
}  // namespace splid::checks
