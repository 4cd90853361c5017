#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "daemon/view/sparkline.hpp"
#include "protocol/scene_json.hpp"

namespace splid::view {

// A scene as lines of text. Where the directions of its pixels form a grid, the lines are pictures
// of range and velocity side by side, as seen by the lidar, two characters a pixel or one where the
// terminal has not so many columns, with the scale in the first line; `.` or `·` stands for a pixel
// without a value. Otherwise there is a line for each pixel. Lines may be longer than the terminal.
//
// Threads: any. Errors: none.
std::vector<std::string> field_lines(const SceneMessage& scene, Characters characters,
                                     std::size_t columns);

}  // namespace splid::view
