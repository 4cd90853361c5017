#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace splid::test {

// A record of a tags16 block, as docs/reference/tags16.md has it.
struct Tags16Record {
  std::int64_t time_ps = 0;
  std::int32_t channel = 0;
  std::uint8_t type = 0;
  std::uint16_t missed = 0;
  std::uint8_t reserved = 0;
};

// A block; members may lie, so that a reader's checks can be tested.
struct Tags16Block {
  std::uint32_t sequence = 0;
  std::int64_t begin_ps = 0;
  std::int64_t end_ps = 0;
  std::vector<Tags16Record> records;
  std::uint16_t version = 1;
  std::uint16_t flags = 0;
  std::uint32_t more_count = 0;  // that the header says beyond the records
};

// Writes a number at a place, and returns the place behind it.
template <class Number>
std::byte* put_little_endian(Number value, std::byte* at) {
  static_assert(std::endian::native == std::endian::little);
  std::memcpy(at, &value, sizeof value);
  return at + sizeof value;
}

template <class Number>
void append_little_endian(Number value, std::vector<std::byte>& bytes) {
  bytes.resize(bytes.size() + sizeof value);
  put_little_endian(value, &bytes[bytes.size() - sizeof value]);
}

// Design note: room for all at once. Byte by byte this took 38 % of the processor time of the
// tests Faults.AStopped* and Faults.StrangersAtTheC* under the thread sanitizer.
inline void append_block(const Tags16Block& block, std::vector<std::byte>& bytes) {
  const std::size_t begin = bytes.size();
  bytes.resize(begin + 32 + 16 * block.records.size());
  std::byte* at = &bytes[begin];
  for (const char letter : {'S', 'P', 'T', 'B'}) at = put_little_endian(letter, at);
  at = put_little_endian(block.version, at);
  at = put_little_endian(block.flags, at);
  at = put_little_endian(static_cast<std::uint32_t>(block.records.size()) + block.more_count, at);
  at = put_little_endian(block.sequence, at);
  at = put_little_endian(block.begin_ps, at);
  at = put_little_endian(block.end_ps, at);
  for (const Tags16Record& record : block.records) {
    at = put_little_endian(record.type, at);
    at = put_little_endian(record.reserved, at);
    at = put_little_endian(record.missed, at);
    at = put_little_endian(record.channel, at);
    at = put_little_endian(record.time_ps, at);
  }
}

inline std::vector<std::byte> block_bytes(const Tags16Block& block) {
  std::vector<std::byte> bytes;
  append_block(block, bytes);
  return bytes;
}

}  // namespace splid::test
