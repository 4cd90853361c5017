#include <algorithm>
#include <utility>
#include <vector>

#include "drivers/usb/ttm_decode.hpp"
#include "tests/fuzz/fuzz.hpp"

// Records of a BrightEyes-TTM, cut anywhere: whole words are used, the cuts make no difference,
// times go on but at clock breaks and by a period within a record, and losses begin and end in
// turn.

namespace splid::test::fuzz_ttm {
namespace {

std::vector<Tag> decode(std::span<const std::byte> bytes, std::size_t piece,
                        std::size_t room_tags) {
  usb::TtmDecoder decoder;
  std::vector<Tag> tags;
  std::vector<Tag> room(room_tags);
  while (bytes.size() >= usb::TtmDecoder::word_bytes) {
    const auto done = decoder.decode(bytes.first(std::min(piece, bytes.size())), room);
    must(done.bytes % usb::TtmDecoder::word_bytes == 0, "whole words are used");
    must(done.bytes > 0, "decoding goes on");
    must(done.tags <= room.size(), "no more than there is room");
    tags.insert(tags.end(), room.begin(), room.begin() + static_cast<std::ptrdiff_t>(done.tags));
    bytes = bytes.subspan(done.bytes);
  }
  return tags;
}

void check_times(const std::vector<Tag>& tags) {
  constexpr std::int64_t period_ps = 4167;
  bool lost = false;
  std::int64_t latest_ps = 0;
  for (const Tag& tag : tags) {
    must(tag.time_ps >= latest_ps - period_ps, "times go on");
    latest_ps = std::max(latest_ps, tag.time_ps);
    if (tag.kind == TagKind::loss_begin) {
      must(!std::exchange(lost, true), "a loss begins once");
    } else if (tag.kind == TagKind::loss_end) {
      must(std::exchange(lost, false), "a loss that began ends");
    } else if (tag.kind == TagKind::clock_break) {
      latest_ps = 0;
    } else if (tag.kind == TagKind::photon) {
      must(tag.value >= 0 && tag.value < usb::TtmDecoder::inputs, "an input");
    } else if (tag.kind == TagKind::marker) {
      must(tag.value >= 1 && tag.value <= 7, "pixel, line or frame");
    }
  }
}

void check(FuzzInput input) {
  const std::size_t piece = usb::TtmDecoder::word_bytes + input.take<std::uint8_t>();
  const auto bytes = input.rest();
  const std::size_t most = usb::TtmDecoder::most_tags_a_word;
  const std::vector<Tag> whole = decode(bytes, bytes.size(), most + bytes.size());
  must(decode(bytes, piece, most + piece % 7) == whole, "tags do not depend on the pieces");
  check_times(whole);
}

}  // namespace
}  // namespace splid::test::fuzz_ttm

SPLID_FUZZ_TARGET(ttm) {
  splid::test::fuzz_ttm::check({data, size});
  return 0;
}
