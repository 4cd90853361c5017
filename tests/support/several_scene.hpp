#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid::test {

inline constexpr double several_c_m_per_ns = 0.299792458;

// [P]'s experiment in 20 ms, with a target at `off_ns` beside [P]'s.
inline FrameMaker scene_of(double off_ns = 0, double velocity_mps = 20, double signal = 13.5e-4) {
  FrameMaker made;
  made.pattern = interleaved_pattern({180000, 189000}, 3780000);
  made.length_ms = 20;
  made.distance_m += off_ns * several_c_m_per_ns / 2;
  made.velocity_mps = velocity_mps;
  made.signal_per_pulse = signal;
  return made;
}

inline FrameEstimator several(const FrameMaker& made, std::int64_t targets,
                              SceneOptions scene = {}) {
  scene.targets = targets;
  return {made.pattern, {}, scene, {}, made.length_ms, 100'000};
}

inline double off_of(const TargetEstimate& found, const FrameMaker& truth) {
  return std::remainder(found.delay_ns - 2 * truth.distance_m / several_c_m_per_ns, 3780);
}

inline void expect_is(const TargetEstimate& found, const FrameMaker& truth) {
  EXPECT_EQ(found.status, FrameStatus::ok);
  EXPECT_GT(found.std_delay_ns, 0);
  EXPECT_LT(std::abs(off_of(found, truth)), 5 * found.std_delay_ns);
  EXPECT_LT(std::abs(found.velocity_mps - truth.velocity_mps), 5 * found.std_velocity_mps);
  EXPECT_LT(std::abs(found.signal_per_pulse - truth.signal_per_pulse),
            5 * found.std_signal_per_pulse);
  EXPECT_GT(found.significance_nats, 20);
}

}  // namespace splid::test
