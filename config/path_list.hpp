#pragma once

#include <string>
#include <vector>

#include "config/config.hpp"

namespace splid {

// A file that a configuration names.
struct NamedPath {
  std::string pointer;  // such as /source/recording
  std::string path;     // resolved
};

// The files that are read because of a configuration: itself and all that its keys name, but for
// those that are written (/source/truth, /metrics/file, /record/folder). Not all need exist.
std::vector<NamedPath> input_files(const Config& config);

}  // namespace splid
