#pragma once

#include "estimator/model/estimate.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/options.hpp"

// The room array/ estimates several pixels together. It stands above FrameEstimator, which
// estimates one. Open this file first. Its parts:
//   known_velocity.hpp   a frame in which a target of known velocity is at rest
//   velocity_votes.hpp   the velocity that most pixels show
//   shared_fit.hpp       the maximum of the joint likelihood of pixels that share a velocity
//   rigid_scene.hpp      the pixels that share a velocity, and their estimates
//   neighbours.hpp       which pixels look beside each other
//   pixel_track.hpp      where each pixel looks first: its own last frame, or its neighbours'
//   pooled_scene.hpp     the photons of neighbours together, where one pixel has too few

namespace splid::array {

// A velocity, with what it is known to.
struct Velocity {
  double mps = 0;
  double std_mps = 0;
};

// The same frame with the pattern's clock slower by 1 - g: the photons of a target at this velocity
// are then those of a target at rest, at the delay D that it has at mid-frame.
//
// The light of a period's pulse at t_p is back at (D + t_p + n P) / (1 - g), counted from mid-frame
// in the pattern's clock (FoldedFrame). A clock with the period P / (1 - g), that has the same
// phase at mid-frame, puts this light at D + t_p + n P.
FrameView at_rest(const FrameView& frame, double velocity_mps);

// The delay D that an estimate has at mid-frame, in the pattern's clock.
// period_ns: of the calibrated pattern.
double pattern_delay_ns(const Estimate& estimate, const FrameView& frame, double period_ns,
                        ClockReference reference);

// An estimate of the frame at_rest() becomes that of a target at this velocity in the frame itself.
void set_moving(Estimate& estimate, const FrameView& frame, const Velocity& velocity,
                ClockReference reference);

}  // namespace splid::array
