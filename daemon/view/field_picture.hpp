#pragma once

#include <string>
#include <vector>

#include "daemon/view/sparkline.hpp"
#include "protocol/scene_json.hpp"

namespace splid::view {

// A scene as lines of text. Where the directions of its pixels form a grid, the lines are pictures
// of range and velocity side by side, as seen by the lidar, two characters a pixel, with the scale
// in the first line; `.` or `·` stands for a pixel without a value. Otherwise there is a line for
// each pixel.
//
// Threads: any. Errors: none.
std::vector<std::string> field_lines(const SceneMessage& scene, Characters characters);

}  // namespace splid::view
