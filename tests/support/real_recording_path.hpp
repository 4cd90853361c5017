#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace splid::test {

// Where a recording of a real instrument is, if it is there at all: in the folder that SPLID_DATA
// names, or beside the source.
inline std::filesystem::path real_recording_path(const std::string& name) {
  const char* folder = std::getenv("SPLID_DATA");
  if (folder != nullptr) return std::filesystem::path(folder) / name;
  return std::filesystem::path(SPLID_SOURCE_DIR).parent_path() / "shared" / "data" / name;
}

}  // namespace splid::test
