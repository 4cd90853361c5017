#pragma once

#include <optional>
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

// The fault of a configuration by which a file would be written over one that is read because of
// it, also by another path or through a link; absent where there is none.
std::optional<OptionFault> written_file_fault(const Config& config);

}  // namespace splid
