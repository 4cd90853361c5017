#pragma once

#include <Eigen/Core>

#include "estimator/fit/likelihood.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// Expected Fisher information of a frame at the true parameters, order and units of ParameterIndex:
// J = integral of (d lambda)(d lambda)^T / lambda over the time seen. Its inverse bounds the
// covariance of any unbiased estimate (Cramer and Rao). [P] Eq. 12 and 13, generalised to unequal
// amplitudes, any number of pulses, any pulse shape, overlapping pulses, several stretches and
// steady state, with the delay at mid-frame.
//
// Accuracy: 1e-6 relative for gaussian pulses; losses count by their share of the time, and a frame
// begins with its pattern. Not for the way of a frame: it integrates over all pulses of the period
// and allocates.
Eigen::Matrix4d fisher_information(const PulseShape& shape, const PulseTrain& train,
                                   const Exposure& exposure, const FrameParameters& at);

// A target and a frame of it.
struct BoundScene {
  double length_ns = 0;  // t_a
  double seen_ns = 0;    // t_a less losses
  double delay_ns = 0;   // round trip at mid-frame
  double velocity_mps = 0;
  double signal_per_pulse = 0;   // S > 0
  double background_per_ns = 0;  // b
  bool moving = true;            // false: the velocity is known to be zero
};

// The smallest standard deviation that an unbiased estimate of the scene can have; infinite where
// the photons tell nothing, 0 for a velocity or a background that is known.
struct Bound {
  double delay_ns = 0;        // at mid-frame
  double delay_start_ns = 0;  // at the frame's start, as [P] gives it
  double velocity_mps = 0;
  double signal_per_pulse = 0;
  double background_per_ns = 0;
};

// Source: fisher_information().
Bound cramer_rao_bound(const Pattern& pattern, const PulseShape& shape, const BoundScene& scene);

}  // namespace splid
