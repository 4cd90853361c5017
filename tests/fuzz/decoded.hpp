#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "protocol/record_decoder.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace splid::test {

// All that a decoder makes of a recording's records.
struct Decoded {
  std::vector<Tag> tags;
  std::uint64_t unknown = 0;
  std::uint64_t overflows = 0;

  friend bool operator==(const Decoded&, const Decoded&) = default;
};

// piece: most tags that the decoder has room for at a time, at least 1.
inline Decoded decode_in_pieces(RecordDecoder& decoder, std::span<const std::byte> records,
                                std::size_t piece) {
  Decoded decoded;
  std::vector<Tag> room(piece);
  for (;;) {
    const auto done = decoder.decode(records, room);
    must(done.bytes % decoder.record_bytes() == 0, "whole records are used");
    must(done.tags <= room.size() && done.bytes <= records.size(), "no more is used than given");
    decoded.tags.insert(decoded.tags.end(), room.begin(),
                        room.begin() + static_cast<std::ptrdiff_t>(done.tags));
    records = records.subspan(done.bytes);
    if (done.bytes + done.tags == 0) break;
  }
  must(records.size() < decoder.record_bytes(), "every whole record is used");
  decoded.unknown = decoder.unknown_records();
  decoded.overflows = decoder.overflow_records();
  return decoded;
}

}  // namespace splid::test
