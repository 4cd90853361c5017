#pragma once

#include <span>
#include <vector>

#include "estimator/fit/bound.hpp"
#include "estimator/several/joint_likelihood.hpp"

namespace splid {

// The expected Fisher information of a frame with several targets at the true parameters, in the
// order and the units of JointParameters: see fisher_information(), whose value it has for a single
// target. Where pulses of two targets overlap, each is the less certain for it.
//
// Accuracy: 1e-4 relative for gaussian pulses. Threads: any. Errors: none. Allocates and integrates
// over the whole period at 64 times of the frame: it is for studies.
SmallMatrix joint_information(const PulseShape& shape, const PulseTrain& train,
                              const Exposure& exposure, const JointParameters& at);

// The smallest standard deviations that an unbiased estimate of several targets can have, one bound
// for each target; see cramer_rao_bound(). scenes: one for each target, of the same frame, the same
// background and an ideal detector; `moving` is that of the first.
std::vector<Bound> joint_bound(const Pattern& pattern, const PulseShape& shape,
                               std::span<const BoundScene> scenes);

}  // namespace splid
