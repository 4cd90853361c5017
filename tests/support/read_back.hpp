#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/replay/recording_reader.hpp"
#include "protocol/tag.hpp"

namespace splid::test {

// The tags of a recording's records.
inline std::vector<Tag> read_back(const std::string& file) {
  RecordingReader reader(file, [](const std::string&) {});
  std::vector<Tag> tags;
  std::vector<Tag> block(4096);
  while (const std::size_t count = reader.read(block)) {
    tags.insert(tags.end(), block.begin(), block.begin() + static_cast<std::ptrdiff_t>(count));
  }
  return tags;
}

// The recordings in a folder, oldest first; none where there is no such folder.
inline std::vector<std::string> recordings_in(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code absent;
  for (const auto& entry : std::filesystem::directory_iterator(folder, absent)) {
    if (entry.path().extension() == ".ptu") files.push_back(entry.path().string());
  }
  // By their running numbers: the 10 characters before the end.
  const auto number = [](const std::string& file) { return file.substr(file.size() - 10); };
  std::sort(files.begin(), files.end(),
            [&](const std::string& a, const std::string& b) { return number(a) < number(b); });
  return files;
}

}  // namespace splid::test
