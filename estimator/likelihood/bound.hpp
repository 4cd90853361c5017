#pragma once

#include <span>
#include <vector>

#include "estimator/likelihood/exposure.hpp"
#include "estimator/likelihood/live_fraction.hpp"
#include "estimator/likelihood/model.hpp"
#include "estimator/likelihood/small_matrix.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// The expected Fisher information of a frame about all parameters of its model, in the places of
// model.hpp, at the true values: J = integral of (d lambda)(d lambda)^T / lambda over the time seen
// in which the detector is live. Its inverse bounds the covariance of any unbiased estimate.
// Source: [P] Eq. 12 and 13, generalised to any pulses, targets and segments in the steady state,
// with the delay at mid-frame.
//
// Accuracy: 1e-6 relative for gaussian pulses of targets that move alike, else 1e-4. Losses count
// by their share of the time; the frame begins with the pattern. For studies: allocates.
SmallMatrix expected_information(const PulseShape& shape, const PulseTrain& train,
                                 const Exposure& exposure, const likelihood::Model& at,
                                 const DeadDetector& detector = {});

// A target, and a frame in which it is seen. All times are in ns.
struct BoundScene {
  double length_ns = 0;  // t_a
  double seen_ns = 0;    // t_a less losses
  double delay_ns = 0;   // round trip at mid-frame
  double velocity_mps = 0;
  double signal_per_pulse = 0;   // S > 0
  double background_per_ns = 0;  // b
  bool moving = true;            // false: the velocity is known to be zero
  bool accelerating = false;     // true: the acceleration is unknown too, and near zero
  DeadDetector detector = {};
  bool width_unknown = false;  // true: the width of the pulse is unknown too
};

// The smallest standard deviations that an unbiased estimate of a scene can have. They are infinite
// where the photons tell nothing, and 0 for a velocity, a background or a width that is known.
struct Bound {
  double delay_ns = 0;        // at mid-frame
  double delay_start_ns = 0;  // at the frame's start, as [P] gives it
  double velocity_mps = 0;
  double signal_per_pulse = 0;
  double background_per_ns = 0;
  double acceleration_mps2 = 0;
  double pulse_sigma_ns = 0;
};

// The bound of a scene, from expected_information(). scene: signal_per_pulse > 0.
Bound cramer_rao_bound(const Pattern& pattern, const PulseShape& shape, const BoundScene& scene);

// The same of several targets together, one bound for each. scenes: one for each target, of the
// same frame, background and detector; what is unknown is that of the first.
std::vector<Bound> joint_bound(const Pattern& pattern, const PulseShape& shape,
                               std::span<const BoundScene> scenes);

}  // namespace splid
