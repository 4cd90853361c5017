#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "protocol/tag.hpp"

namespace splid {

// Turns the records of a recording into tags. Each format of records is a class of its own;
// make_decoder() in protocol/recording_format.hpp makes the one that a header asks for.
//
// Threads: one. No allocation.
class RecordDecoder {
 public:
  struct Progress {
    std::size_t bytes = 0;  // used, a whole number of records; a cut record is left over
    std::size_t tags = 0;   // written
  };

  RecordDecoder() = default;
  RecordDecoder(const RecordDecoder&) = default;
  RecordDecoder& operator=(const RecordDecoder&) = default;
  virtual ~RecordDecoder() = default;

  // All records of a recording are of one length.
  [[nodiscard]] virtual std::size_t record_bytes() const = 0;

  // Decodes until either `records` or `out` is used up. `records` may start at any alignment. The
  // clock goes on from the last call. Where a record gives more tags than `out` has room for, the
  // rest comes with the next call. Elements of `out` past the tags written hold nothing of use.
  virtual Progress decode(std::span<const std::byte> records, std::span<Tag> out) = 0;

  // How many records so far stand for nothing that is known.
  [[nodiscard]] virtual std::uint64_t unknown_records() const = 0;
  // How many records so far only moved the clock on; each may stand for several of its wraps.
  [[nodiscard]] virtual std::uint64_t overflow_records() const { return 0; }
  // Photons whose time since their sync could not be told; each became a `missed` tag.
  [[nodiscard]] virtual std::uint64_t saturated_photons() const { return 0; }
  // A time that the records have reached; no later tag is earlier by more than the stream's
  // disorder.
  [[nodiscard]] virtual std::int64_t reached_ps() const = 0;
};

// A PicoQuant record's length, in every one of its formats and modes.
inline constexpr std::size_t ptu_record_bytes = 4;

// The tag of a photon that a recording has, but not its time: the module's time converter was
// saturated, or marked its time as invalid. A `missed` tag, whose first spare byte has the input,
// so that a recording made of the tags keeps the photon where it was.
constexpr TagMeaning untimed_photon(int input) {
  return {1, TagKind::missed, {static_cast<std::uint8_t>(input), 0, 0}};
}
constexpr int input_of_untimed(const Tag& tag) { return tag.reserved[0]; }

// The number that 4 bytes at any alignment hold, the lowest byte first.
inline std::uint32_t little_endian_32(const std::byte* bytes) {
  std::uint32_t value = 0;
  if constexpr (std::endian::native == std::endian::little) {
    std::memcpy(&value, bytes, sizeof value);
  } else {
    for (int i = 3; i >= 0; --i) value = (value << 8U) | std::to_integer<std::uint32_t>(bytes[i]);
  }
  return value;
}

}  // namespace splid
