#pragma once

#include <sstream>
#include <string>
#include <vector>

#include "protocol/frame_json.hpp"

namespace splid::test {

// The frames in what `splid replay --json` prints, a line each.
inline std::vector<FrameMessage> frames_in(const std::string& lines) {
  std::vector<FrameMessage> frames;
  std::istringstream in(lines);
  for (std::string line; std::getline(in, line);) frames.push_back(frame_from_json(line));
  return frames;
}

}  // namespace splid::test
