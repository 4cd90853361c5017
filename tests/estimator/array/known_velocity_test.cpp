#include "estimator/array/known_velocity.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid::array {
namespace {

// A target of known velocity is one at rest in the frame of at_rest(), and its delays there are
// those of the moving target: in either clock, with a drift, and where a frame does not begin with
// a pattern. What is known of the velocity moves the delay by less than 1e-3 deviations, as the two
// do not correlate at mid-frame.
TEST(KnownVelocity, AFrameAtRestHasTheDelaysOfTheMovingTarget) {
  for (const double velocity_mps : {-140.0, 0.0, 77.0}) {
    test::FrameMaker made;
    made.pattern = test::interleaved_pattern({180000, 189000}, 3780000);
    made.velocity_mps = velocity_mps;
    made.drift_ppm = 100;
    made.start_ps = 340'000'000'000'000'000;
    auto frame = made.make(7);
    frame.sync.origin_ps += 25'000'000'123;
    frame.sync.phase_ps = std::remainder(-25'000'000'123.0, frame.sync.period_ps);
    for (const ClockReference reference : {ClockReference::tagger, ClockReference::pattern}) {
      SceneOptions scene;
      FrameEstimator moving(made.pattern, {}, scene, {}, made.length_ms, 50'000, reference);
      const Estimate free = moving.estimate(frame.view());
      ASSERT_EQ(free.status, FrameStatus::ok);
      scene.motion = Motion::static_target;
      FrameEstimator resting(made.pattern, {}, scene, {}, made.length_ms, 50'000, reference);
      const FrameView still = at_rest(frame.view(), free.velocity_mps);
      Estimate known = resting.estimate(still);
      ASSERT_EQ(known.status, FrameStatus::ok);
      const double from_free = pattern_delay_ns(free, frame.view(), 3780, reference);
      const double from_known = pattern_delay_ns(known, still, 3780, reference);
      EXPECT_NEAR(from_known, from_free, 1e-2 * free.std_delay_ns);
      set_moving(known, frame.view(), {free.velocity_mps, free.std_velocity_mps}, reference);
      EXPECT_NEAR(known.delay_ns, free.delay_ns, 1e-2 * free.std_delay_ns);
      EXPECT_NEAR(known.delay_start_ns, free.delay_start_ns, 1e-2 * free.std_delay_ns);
      EXPECT_EQ(known.velocity_mps, free.velocity_mps);
      EXPECT_NEAR(known.significance_nats, free.significance_nats, 1e-3);
      EXPECT_LE(known.std_delay_ns, free.std_delay_ns);
    }
  }
}

}  // namespace
}  // namespace splid::array
