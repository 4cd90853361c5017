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

// The most that a FrameEstimator makes. 1 GiB of tables takes a second or two to make, and a
// photon's place is reserved for each pulse that it may be near to.
inline constexpr std::size_t most_search_bytes = std::size_t{1} << 30;
inline constexpr std::size_t most_pulses_near = 256;

// Why such a search would be too large, with what to do; empty where it is not. Nothing large is
// made. Arguments, threads, errors: as above.
std::optional<OptionFault> too_large_a_search(const Pattern& pattern, const PulseOptions& pulse,
                                              const SceneOptions& scene,
                                              const EstimatorOptions& options,
                                              double frame_length_ms);

}  // namespace splid
