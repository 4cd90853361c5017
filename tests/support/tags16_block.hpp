#pragma once

#include <cstddef>
#include <cstdint>
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

template <class Number>
void append_little_endian(Number value, std::vector<std::byte>& bytes) {
  auto rest = static_cast<std::uint64_t>(value);
  for (std::size_t i = 0; i < sizeof value; ++i, rest >>= 8U) {
    bytes.push_back(static_cast<std::byte>(rest & 0xFFU));
  }
}

inline void append_block(const Tags16Block& block, std::vector<std::byte>& bytes) {
  for (const char letter : {'S', 'P', 'T', 'B'}) bytes.push_back(static_cast<std::byte>(letter));
  append_little_endian(block.version, bytes);
  append_little_endian(block.flags, bytes);
  const auto count = static_cast<std::uint32_t>(block.records.size()) + block.more_count;
  append_little_endian(count, bytes);
  append_little_endian(block.sequence, bytes);
  append_little_endian(block.begin_ps, bytes);
  append_little_endian(block.end_ps, bytes);
  for (const Tags16Record& record : block.records) {
    append_little_endian(record.type, bytes);
    append_little_endian(record.reserved, bytes);
    append_little_endian(record.missed, bytes);
    append_little_endian(record.channel, bytes);
    append_little_endian(record.time_ps, bytes);
  }
}

inline std::vector<std::byte> block_bytes(const Tags16Block& block) {
  std::vector<std::byte> bytes;
  append_block(block, bytes);
  return bytes;
}

}  // namespace splid::test
