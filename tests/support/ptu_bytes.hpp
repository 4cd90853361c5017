#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
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
  std::vector<Tag> tags(records.size() / ptu_record_bytes + 1);
  tags.resize(decoder.decode(records, tags).tags);
  return tags;
}

}  // namespace splid::test
