#include <optional>

#include "protocol/ptu_decode.hpp"
#include "protocol/ptu_header.hpp"
#include "tests/fuzz/fuzz.hpp"

// A recording: its header, given whole and bit by bit, then its records, decoded at one go and in
// pieces. Each record is a tag, an overflow or unknown; pieces make no difference.

namespace splid::test {
namespace {

// As readers of files do: more of it until the header is there.
std::optional<PtuHeader> header_in_pieces(std::span<const std::byte> bytes) {
  for (std::size_t size = 1; size < bytes.size(); size += 1 + size / 2) {
    if (auto header = parse_ptu_header(bytes.first(size), false)) return header;
  }
  return parse_ptu_header(bytes, true);
}

struct Decoded {
  std::vector<Tag> tags;
  std::uint64_t unknown = 0;
  std::uint64_t overflows = 0;
};

Decoded decode(const PtuHeader& header, std::span<const std::byte> records, std::size_t piece) {
  PtuDecoder decoder(header.record_type, header.resolution_s, header.origin_ps);
  Decoded decoded;
  std::vector<Tag> room(piece);
  while (records.size() >= PtuDecoder::record_bytes) {
    // A cut record is the caller's to bring again.
    const auto some = records.first(std::min(records.size(), 4 * piece + piece % 4));
    const auto done = decoder.decode(some, room);
    must(done.bytes > 0 && done.bytes % PtuDecoder::record_bytes == 0, "whole records are used");
    decoded.tags.insert(decoded.tags.end(), room.begin(),
                        room.begin() + static_cast<std::ptrdiff_t>(done.tags));
    records = records.subspan(done.bytes);
  }
  decoded.unknown = decoder.unknown_records();
  decoded.overflows = decoder.overflow_records();
  return decoded;
}

void check(std::span<const std::byte> bytes) {
  std::optional<PtuHeader> header;
  const bool good = accepts(Fault::data, [&] { header = parse_ptu_header(bytes, true); });
  std::optional<PtuHeader> again;
  must(accepts(Fault::data, [&] { again = header_in_pieces(bytes); }) == good,
       "a header is good or bad, however it comes");
  if (!good) return;
  must(again->header_bytes == header->header_bytes, "a header has one length");
  must(header->header_bytes <= bytes.size(), "the records start in the file");
  const auto records = bytes.subspan(header->header_bytes);
  const Decoded whole = decode(*header, records, records.size() / 4 + 1);
  must(whole.tags.size() + whole.unknown + whole.overflows == records.size() / 4,
       "each record is a tag, an overflow or unknown");
  for (const Tag& tag : whole.tags) must(is_event(tag.kind), "records are events");
  const Decoded pieces = decode(*header, records, 1 + records.size() % 5);
  must(pieces.tags == whole.tags, "tags do not depend on the pieces");
}

}  // namespace
}  // namespace splid::test

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  splid::test::check(std::as_bytes(std::span(data, size)));
  return 0;
}
