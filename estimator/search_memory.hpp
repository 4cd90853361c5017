#pragma once

#include <cstddef>
#include <optional>

#include "estimator/model/options.hpp"
#include "protocol/options.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// Bytes of the tables of a FrameEstimator's search, the only part of it that grows with the frame's
// length and the largest speed. Arguments: as FrameEstimator's. Errors: std::bad_alloc alone.
std::size_t search_table_bytes(const Pattern& pattern, const PulseOptions& pulse,
                               const SceneOptions& scene, const EstimatorOptions& options,
                               double frame_length_ms);

// Why such a search would be too large for a FrameEstimator to make, with what to do; empty where
// it is not. Nothing large is made. Arguments, errors: as above.
std::optional<OptionFault> too_large_a_search(const Pattern& pattern, const PulseOptions& pulse,
                                              const SceneOptions& scene,
                                              const EstimatorOptions& options,
                                              double frame_length_ms);

}  // namespace splid
