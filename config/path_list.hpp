#pragma once

#include <string>
#include <vector>

#include "config/config.hpp"

namespace splid {

// A file that a configuration names.
struct NamedPath {
  std::string pointer;  // such as /source/recording
  std::string path;     // absolute, or relative to the working folder
};

// The files that are read because of a configuration: the configuration itself and all files that
// its keys name, except those that are written (/source/truth, /metrics/file, /record/folder). Some
// may not exist.
std::vector<NamedPath> input_files(const Config& config);

}  // namespace splid
