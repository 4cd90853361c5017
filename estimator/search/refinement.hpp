#pragma once

#include <limits>

#include "estimator/likelihood/maximizer.hpp"
#include "estimator/model/estimate.hpp"
#include "estimator/model/pulse_train.hpp"
#include "estimator/search/fit.hpp"

namespace splid {

// Climbs to the maximum of the likelihood near a line, by likelihood::Maximizer.
//
// Threads: one thread for each object. Errors: none. No allocation in the calls for frames of up to
// max_photons.
class Refinement {
 public:
  // Memory is reserved for max_photons, each of them near as many pulses as overlap at most.
  // may_be_blind: frames may come with their blind time.
  Refinement(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons,
             bool may_be_blind = false);

  // The maximum near `start`, which should be within two pulse widths of it. moving: false keeps
  // the range walk of `start`. to_beat_nats: a maximum that cannot have this gain is given
  // up before it is reached; the result then has the stop reason `beaten`, no covariance, and less
  // gain. roughly: a thousandth of a deviation does not matter, as where a sample of a frame's
  // photons says where to look.
  Fit climb(const FoldedFrame& frame, DelayTrack start, bool moving,
            double to_beat_nats = -std::numeric_limits<double>::infinity(), bool roughly = false);

  // The likelihood and its curvature at given parameters, without a climb.
  Fit judge(const FoldedFrame& frame, const FrameParameters& at, bool moving);

 private:
  likelihood::Maximizer maximizer_;
};

}  // namespace splid
