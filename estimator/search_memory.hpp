#pragma once

#include <cstddef>

#include "estimator/model/options.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// What the tables of a FrameEstimator's search over delay and velocity take, bytes, from its
// construction on. They are the only part of it that grows with the frame's length and the largest
// speed: a cell for each delay and slice of a frame, and the sums along all lines. The others grow
// with the photons of a frame.
//
// Arguments: as those of FrameEstimator. Threads: any. Errors: std::bad_alloc alone.
std::size_t search_table_bytes(const Pattern& pattern, const PulseOptions& pulse,
                               const SceneOptions& scene, const EstimatorOptions& options,
                               double frame_length_ms);

}  // namespace splid
