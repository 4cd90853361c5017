#include <algorithm>
#include <optional>

#include "protocol/ptu_decode.hpp"
#include "protocol/ptu_header.hpp"
#include "protocol/ptu_t3_decode.hpp"
#include "tests/fuzz/fuzz.hpp"

// A recording: its header, given whole and bit by bit, then its records, decoded at one go and in
// pieces. Each record is a tag, an overflow or unknown; pieces make no difference.

namespace splid::test::fuzz_ptu {
namespace {

// As readers of files do: more of it until the header is there.
std::optional<RecordingHeader> header_in_pieces(std::span<const std::byte> bytes) {
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

template <class Decoder>
Decoded decode_by(Decoder decoder, std::span<const std::byte> records, std::size_t piece) {
  Decoded decoded;
  std::vector<Tag> room(piece);
  while (records.size() >= ptu_record_bytes) {
    // A cut record is the caller's to bring again.
    const auto some = records.first(std::min(records.size(), 4 * piece + piece % 4));
    const auto done = decoder.decode(some, room);
    must(done.bytes + done.tags > 0 && done.bytes % ptu_record_bytes == 0,
         "whole records are used");
    decoded.tags.insert(decoded.tags.end(), room.begin(),
                        room.begin() + static_cast<std::ptrdiff_t>(done.tags));
    records = records.subspan(done.bytes);
  }
  // Of T3 records the second of two tags may still wait for room.
  const auto rest = decoder.decode({}, room);
  decoded.tags.insert(decoded.tags.end(), room.begin(),
                      room.begin() + static_cast<std::ptrdiff_t>(rest.tags));
  decoded.unknown = decoder.unknown_records();
  decoded.overflows = decoder.overflow_records();
  return decoded;
}

Decoded decode(const RecordingHeader& header, std::span<const std::byte> records,
               std::size_t piece) {
  if (!header.is_t3) {
    return decode_by(
        PtuDecoder(header.record_type, header.resolution_s, header.origin_ps, header.inputs),
        records, piece);
  }
  return decode_by(
      PtuT3Decoder(header.record_type, header.sync_period_s * 1e12, header.resolution_s), records,
      piece);
}

// The tags that stand for records: the syncs of T3 stand for none.
std::size_t tags_of_records(const RecordingHeader& header, const std::vector<Tag>& tags) {
  if (!header.is_t3) return tags.size();
  return static_cast<std::size_t>(std::count_if(
      tags.begin(), tags.end(), [](const Tag& tag) { return tag.kind != TagKind::sync; }));
}

void check(std::span<const std::byte> bytes) {
  std::optional<RecordingHeader> header;
  const bool good = accepts(Fault::data, [&] { header = parse_ptu_header(bytes, true); });
  std::optional<RecordingHeader> again;
  must(accepts(Fault::data, [&] { again = header_in_pieces(bytes); }) == good,
       "a header is good or bad, however it comes");
  if (!good) return;
  must(again->header_bytes == header->header_bytes, "a header has one length");
  must(header->header_bytes <= bytes.size(), "the records start in the file");
  const auto records = bytes.subspan(header->header_bytes);
  const Decoded whole = decode(*header, records, records.size() / 2 + 1);
  must(tags_of_records(*header, whole.tags) + whole.unknown + whole.overflows == records.size() / 4,
       "each record is a tag, an overflow or unknown");
  for (const Tag& tag : whole.tags) {
    must(is_event(tag.kind) || (header->is_t3 && tag.kind == TagKind::missed),
         "records are events, or photons that are lost");
  }
  const Decoded pieces = decode(*header, records, 1 + records.size() % 5);
  must(pieces.tags == whole.tags, "tags do not depend on the pieces");
}

}  // namespace
}  // namespace splid::test::fuzz_ptu

SPLID_FUZZ_TARGET(ptu) {
  splid::test::fuzz_ptu::check(std::as_bytes(std::span(data, size)));
  return 0;
}
