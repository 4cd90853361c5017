#pragma once

#include <Eigen/Core>
#include <limits>

#include "estimator/fit/likelihood.hpp"
#include "estimator/model/estimate.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// A maximum of the likelihood and what surrounds it.
struct Fit {
  FrameParameters parameters;
  double gain_nats = 0;  // over no target
  // Inverse of the observed information at the maximum, order of ParameterIndex; the travel's row
  // and column are zero for a target at rest.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  bool has_covariance = false;  // false: the maximum is not a hill in all directions
  Stop stop = Stop::not_run;
};

// Climbs to the maximum of the likelihood near a line by Newton's method on (delay, travel), with
// the best (S, b) at every step ([P] alternates L-BFGS on the two pairs; the maximum is the same).
//
// Threads: one an object. No allocation in climb() for frames within the sizes given.
class Refinement {
 public:
  // max_photons, and with them the entries of the widest overlap of pulse windows, set the memory.
  Refinement(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons);

  // start: within about two pulse widths of the maximum. moving false keeps start's travel.
  // to_beat_nats: a maximum that surely has less gain is left before it is reached; what is given
  // back then has less gain too, no covariance, and the stop reason `beaten`.
  Fit climb(const FoldedFrame& frame, const Exposure& exposure, DelayLine start, bool moving,
            double to_beat_nats = -std::numeric_limits<double>::infinity());

  // The likelihood and its curvature at given parameters, without a step.
  Fit judge(const FoldedFrame& frame, const Exposure& exposure, const FrameParameters& at,
            bool moving);

 private:
  Fit climb_within(const Exposure& exposure, DelayLine start, bool moving, double to_beat_nats);
  void add_covariance(const Exposure& exposure, bool moving, Fit& fit);

  const PulseTrain& train_;
  double width_ns_;
  double margin_ns_;  // how far the line may move before the near set is collected anew
  std::vector<CombWindow> windows_;  // one a stretch
  NearSet near_;
  Likelihood likelihood_;
};

}  // namespace splid
