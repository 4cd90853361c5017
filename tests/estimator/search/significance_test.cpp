#include "estimator/search/significance.hpp"

#include <gtest/gtest.h>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid {
namespace {

TEST(Significance, ThresholdGrowsWithWhatIsSearched) {
  const double base = significance_threshold_nats({3780, 50, 0.1}, 1e-3);
  EXPECT_GT(base, significance_threshold_nats({3780, 50, 0.1}, 1e-2));
  EXPECT_GT(base, significance_threshold_nats({3780, 5, 0.1}, 1e-3));
  EXPECT_GT(base, significance_threshold_nats({378, 50, 0.1}, 1e-3));
  EXPECT_GT(base, significance_threshold_nats({3780, 50, 1}, 1e-3));
  EXPECT_GT(base, significance_threshold_nats({3780, 0, 0.1}, 1e-3));
  EXPECT_LT(base, significance_threshold_nats({3780, 50, 0.1, 13}, 1e-3));
  // A tenth of the rate costs ln 10 nats, and a little less for the factor u before the
  // exponential.
  const double tenth = significance_threshold_nats({3780, 50, 0.1}, 1e-4);
  EXPECT_NEAR(tenth - base, 2.35, 0.1);
}

TEST(Significance, ASingleLookIsTheNormalTail) {
  // One look at one place: P(Z > 3.0902) = 1e-3.
  EXPECT_NEAR(significance_threshold_nats({1e-9, 0, 1}, 1e-3), 0.5 * 3.0902 * 3.0902, 1e-3);
}

// Background alone: no more frames claim a target than the rate asked for, within the count's
// spread, and not so few that the rate means nothing. 300 frames at 10 %: 30 expected,
// deviation 5.2.
TEST(Significance, FalseAlarmsComeAtTheRateAskedFor) {
  test::FrameMaker made;
  made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
  made.signal_per_pulse = 0;
  made.length_ms = 20;
  EstimatorOptions options;
  options.false_alarm_rate = 0.1;
  SceneOptions scene;
  scene.max_speed_mps = 20;
  FrameEstimator estimator(made.pattern, {}, scene, options, made.length_ms, 20000);
  int alarms = 0;
  const int frames = 300;
  for (int n = 0; n < frames; ++n) {
    const auto frame = made.make(static_cast<std::uint64_t>(n));
    // Most are ambiguous by the odds of their range, and claim a target none the less.
    alarms += estimator.estimate(frame.view()).has_values ? 1 : 0;
  }
  EXPECT_LE(alarms, 46);
  EXPECT_GE(alarms, 3);
}

}  // namespace
}  // namespace splid
