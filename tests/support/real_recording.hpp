#pragma once

#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "protocol/ptu_decode.hpp"
#include "protocol/ptu_header.hpp"
#include "protocol/tag.hpp"

namespace splid::test {

// A recording of a real instrument, in the folder that SPLID_DATA names or beside the source. They
// are other people's data and not part of the repository; tests skip where the file is absent. Each
// of these tests has one beside it that makes what it reads, so that no clone is without it:
// records and headers of their own, streams with few of a fast laser's syncs, or a LaserRecording.
inline std::filesystem::path real_recording_path(const std::string& name) {
  const char* folder = std::getenv("SPLID_DATA");
  if (folder != nullptr) return std::filesystem::path(folder) / name;
  return std::filesystem::path(SPLID_SOURCE_DIR) / ".." / "shared" / "data" / name;
}

inline std::vector<std::byte> file_bytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto* bytes = reinterpret_cast<const std::byte*>(text.data());
  return {bytes, bytes + text.size()};
}

// All tags of a PTU file.
inline std::vector<Tag> ptu_tags(const std::filesystem::path& file) {
  const std::vector<std::byte> bytes = file_bytes(file);
  const RecordingHeader header = parse_ptu_header(bytes, true).value();
  PtuDecoder decoder(header.record_type, header.resolution_s, header.origin_ps);
  std::vector<Tag> tags(bytes.size() / ptu_record_bytes);
  const auto done = decoder.decode(std::span(bytes).subspan(header.header_bytes), tags);
  tags.resize(done.tags);
  return tags;
}

}  // namespace splid::test
