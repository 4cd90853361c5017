#include "protocol/tags16.hpp"

#include "tests/fuzz/fuzz.hpp"

// A stream of tags16 blocks, cut anywhere, with little room and with new connections between: all
// bytes are used, the cuts make no difference, and every byte is of a block or skipped.

namespace splid::test::fuzz_tags16 {
namespace {

struct Decoded {
  std::vector<Tag> tags;
  Tags16Counts counts;
};

Decoded decode(std::span<const std::byte> bytes, std::size_t piece, std::size_t room_tags,
               std::size_t cut_at) {
  Tags16Decoder decoder;
  Decoded decoded;
  std::vector<Tag> room(room_tags);
  std::size_t at = 0;
  bool was_cut = false;
  const auto feed = [&](std::span<const std::byte> some) {
    while (true) {
      const auto done = decoder.decode(some, room);
      must(done.tags <= room.size() && done.bytes <= some.size(), "no more than there is");
      must(done.tags + done.bytes > 0 || some.empty(), "decoding goes on");
      decoded.tags.insert(decoded.tags.end(), room.begin(),
                          room.begin() + static_cast<std::ptrdiff_t>(done.tags));
      some = some.subspan(done.bytes);
      if (some.empty() && done.tags < room.size()) return;
    }
  };
  while (at < bytes.size()) {
    const std::size_t until = at < cut_at ? std::min(cut_at, bytes.size()) : bytes.size();
    const std::size_t count = std::min(piece, until - at);
    feed(bytes.subspan(at, count));
    at += count;
    if (at == cut_at && !was_cut) {
      decoder.cut();
      was_cut = true;
    }
  }
  decoded.counts = decoder.counts();
  return decoded;
}

void check(FuzzInput input) {
  const std::size_t piece = 1 + input.take<std::uint8_t>() % 64;
  const std::size_t room = 1 + input.take<std::uint8_t>() % 8;
  const std::size_t cut_at = input.take<std::uint16_t>();
  const auto bytes = input.rest();
  const Decoded whole = decode(bytes, bytes.size() + 1, 4096, cut_at);
  const Decoded pieces = decode(bytes, piece, room, cut_at);
  must(whole.tags == pieces.tags, "tags do not depend on the pieces");
  must(whole.counts.blocks == pieces.counts.blocks &&
           whole.counts.damaged_blocks == pieces.counts.damaged_blocks &&
           whole.counts.bad_headers == pieces.counts.bad_headers &&
           whole.counts.lost_blocks == pieces.counts.lost_blocks &&
           whole.counts.outside_tags == pieces.counts.outside_tags &&
           whole.counts.skipped_bytes == pieces.counts.skipped_bytes,
       "counts do not depend on the pieces");
  must(whole.counts.skipped_bytes + Tags16Decoder::header_bytes * whole.counts.blocks <=
           bytes.size(),
       "a byte is of a block or skipped");
  for (const Tag& tag : whole.tags) {
    const bool counts = tag.kind == TagKind::loss_end || tag.kind == TagKind::missed;
    must(!counts || tag.value >= -1, "a count is known or -1");
  }
}

}  // namespace
}  // namespace splid::test::fuzz_tags16

SPLID_FUZZ_TARGET(tags16) {
  splid::test::fuzz_tags16::check({data, size});
  return 0;
}
