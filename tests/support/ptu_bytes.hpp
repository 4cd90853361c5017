#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/ptu_decode.hpp"

namespace splid::test {

// Records as they stand in a file.
inline std::vector<std::byte> record_bytes(std::initializer_list<std::uint32_t> records) {
  std::vector<std::byte> bytes;
  for (const std::uint32_t record : records) {
    for (unsigned shift = 0; shift < 32; shift += 8) {
      bytes.push_back(static_cast<std::byte>((record >> shift) & 0xFFU));
    }
  }
  return bytes;
}

// All tags of `records`, decoded at one go.
inline std::vector<Tag> decode_all(PtuDecoder& decoder, std::span<const std::byte> records) {
  std::vector<Tag> tags(records.size() / PtuDecoder::record_bytes + 1);
  tags.resize(decoder.decode(records, tags).tags);
  return tags;
}

// A real recording from the folder that SPLID_DATA names, or ../shared/data beside the source.
// Null where it is not there.
inline std::optional<std::vector<std::byte>> real_recording(const std::string& name) {
  const char* folder = std::getenv("SPLID_DATA");
  const auto file = folder != nullptr ? std::filesystem::path(folder) / name
                                      : std::filesystem::path(SPLID_SOURCE_DIR).parent_path() /
                                            "shared" / "data" / name;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return std::nullopt;
  const std::vector<char> chars{std::istreambuf_iterator<char>(stream), {}};
  const auto bytes = std::as_bytes(std::span(chars));
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

}  // namespace splid::test
