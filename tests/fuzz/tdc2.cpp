#include <array>

#include "drivers/usb/tdc2_decode.hpp"
#include "tests/fuzz/fuzz.hpp"

// Records of a TDC2 with any horizon, cut anywhere: whole records are used, the cuts make no
// difference, times stay within 1 ms of sorted but at clock breaks, and strays are told.

namespace splid::test::fuzz_tdc2 {
namespace {

struct Decoded {
  std::vector<Tag> tags;
  std::uint64_t strays = 0;
};

Decoded decode(std::span<const std::byte> bytes, std::size_t piece, std::size_t room_tags,
               std::int64_t horizon_ps) {
  usb::Tdc2Decoder decoder;
  decoder.set_horizon(horizon_ps);
  Decoded decoded;
  std::vector<Tag> room(room_tags);
  while (bytes.size() >= usb::Tdc2Decoder::record_bytes) {
    const auto done = decoder.decode(bytes.first(std::min(piece, bytes.size())), room);
    must(done.bytes % usb::Tdc2Decoder::record_bytes == 0, "whole records are used");
    must(done.bytes > 0, "decoding goes on");
    must(done.tags <= room.size(), "no more than there is room");
    decoded.tags.insert(decoded.tags.end(), room.begin(),
                        room.begin() + static_cast<std::ptrdiff_t>(done.tags));
    bytes = bytes.subspan(done.bytes);
  }
  decoded.strays = decoder.strays();
  return decoded;
}

void check_times(const Decoded& decoded) {
  constexpr std::int64_t disorder_ps = 1'000'000'000;
  std::uint64_t missed = 0;
  bool begun = false;
  std::int64_t latest_ps = 0;
  for (const Tag& tag : decoded.tags) {
    if (tag.kind == TagKind::missed) {
      missed += static_cast<std::uint64_t>(tag.value);
    } else if (tag.kind == TagKind::clock_break) {
      begun = false;
    } else {
      must(!begun || tag.time_ps >= latest_ps - disorder_ps, "times are nearly sorted");
      latest_ps = begun ? std::max(latest_ps, tag.time_ps) : tag.time_ps;
      begun = true;
    }
    if (tag.kind == TagKind::photon) must(tag.value >= 1 && tag.value <= 4, "four inputs");
  }
  must(missed == decoded.strays, "each stray is a missed tag");
}

void check(FuzzInput input) {
  constexpr std::array<std::int64_t, 4> horizons = {INT64_MAX, 1'000'000'000'000, 0, INT64_MIN};
  const std::int64_t horizon_ps = horizons.at(input.take<std::uint8_t>() % horizons.size());
  const std::size_t piece = usb::Tdc2Decoder::record_bytes + input.take<std::uint8_t>();
  const auto bytes = input.rest();
  const Decoded whole = decode(bytes, bytes.size(), 6 * (bytes.size() / 8 + 1), horizon_ps);
  must(decode(bytes, piece, usb::Tdc2Decoder::most_tags_a_record + piece % 7, horizon_ps).tags ==
           whole.tags,
       "tags do not depend on the pieces");
  check_times(whole);
}

}  // namespace
}  // namespace splid::test::fuzz_tdc2

SPLID_FUZZ_TARGET(tdc2) {
  splid::test::fuzz_tdc2::check({data, size});
  return 0;
}
