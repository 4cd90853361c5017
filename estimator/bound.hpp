#pragma once

#include <Eigen/Core>

#include "estimator/comb.hpp"
#include "estimator/likelihood.hpp"
#include "estimator/pulse_shape.hpp"

namespace splid {

// Expected Fisher information of a frame at the true parameters, order and units of ParameterIndex:
// J = integral of (d lambda)(d lambda)^T / lambda over the time seen. Its inverse bounds the
// covariance of any unbiased estimate (Cramer and Rao). [P] Eq. 12 and 13, generalised to unequal
// amplitudes, any number of pulses, any pulse shape, overlapping pulses and steady state, with the
// delay at mid-frame.
//
// Accuracy: 1e-6 relative for gaussian pulses; losses count by their share of the time. Not for the
// way of a frame: it integrates over all pulses of the period and allocates.
Eigen::Matrix4d fisher_information(const PulseShape& shape, const Comb& comb,
                                   const Exposure& exposure, const FrameParameters& at);

}  // namespace splid
