#pragma once

#include <string>
#include <vector>

#include "protocol/scene_json.hpp"

namespace splid::view {

// What the page draws its pictures of, as JSON.
//
// Threads: any. Errors: none.

// Where the pixels stand, which seldom changes: `pixel` (names), `columns`, `rows` and `cell` of
// each pixel, which counts row by row from the upper left. Pixels whose directions form no grid
// stand in the order of the scene, and `is_grid` is false.
std::string layout_json(const std::vector<SceneMessage::Pixel>& pixels);

// `status` of each pixel, as in a row of History::rows_after(), and `distance_m`, `velocity_mps`
// and `signal_per_pulse`, null for a pixel that is not valid.
std::string picture_json(const SceneMessage& scene);

}  // namespace splid::view
