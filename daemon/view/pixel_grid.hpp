#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "protocol/scene_json.hpp"

namespace splid::view {

// Where the pixels of a scene stand in a picture, as the lidar sees them.
struct PixelGrid {
  std::size_t columns = 0, rows = 0;
  // Of each pixel, in the order of the scene. Cells count from the upper left, row by row.
  std::vector<std::size_t> cells;
};

// Absent where the directions of the pixels form no grid: one has no direction, two have the same,
// or more than half of the cells would be empty.
//
// Threads: any. Errors: none.
std::optional<PixelGrid> pixel_grid(const std::vector<SceneMessage::Pixel>& pixels);

}  // namespace splid::view
