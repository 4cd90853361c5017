#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "protocol/tag.hpp"

namespace splid::usb {

// Turns the records of an S-Fifteen TDC2 (timestamp7) into tags. A record is 64 bits, little
// endian: bits 63 to 10 are the time in 1/256 ns; 9 to 5 are internal; 4 marks a dummy; 3 to 0 are
// the inputs that saw an event.
// Source: readevents7 of S-Fifteen's qcrypto.
//
//  - each input's bit gives a photon tag; value: the input, 1 to 4;
//  - a dummy gives a heartbeat and no photon; an all-zero word, which is padding, gives nothing;
//  - a record whose time is more than 1 ms before the latest, or past the horizon, is a stray: it
//    is left out and counts as one missed tag. After 64 strays in a row that agree with each other,
//    and whose internal bits good records had too, the clock is taken to have been set anew:
//    clock_break. After 64 strays that do not agree, the stream is adrift, which is a loss of
//    unknown count, until two records in a row agree with the clock and with each other. So neither
//    garbage nor misaligned records become times.
//
// Times are 125/32 ps a unit, rounded to the nearest from the whole count, so that no error adds
// up. The 54 bits wrap every 19.5 h; the wrap is followed as long as a record comes within half of
// that. A tag's 64 bits last 106 days: every 53 days there is a clock_break and times go on from 0.
//
// Threads: one. Errors: none, whatever the bytes. No allocation.
class Tdc2Decoder {
 public:
  static constexpr std::size_t record_bytes = 8;
  static constexpr std::size_t most_tags_a_record = 6;

  struct Progress {
    std::size_t bytes = 0;  // used, a whole number of records; a cut record is left
    std::size_t tags = 0;   // written
  };

  // Decodes until fewer than record_bytes are left, or less room than most_tags_a_record.
  Progress decode(std::span<const std::byte> bytes, std::span<Tag> out);

  // No record that comes now can have a later time than this, in the tags' time.
  void set_horizon(std::int64_t time_ps) { horizon_ps_ = time_ps; }

  // Time of the latest record; absent before the first.
  [[nodiscard]] std::optional<std::int64_t> reached_ps() const { return reached_ps_; }
  // Whether the bytes make no sense as records: 64 or more in a row were left out.
  [[nodiscard]] bool is_adrift() const { return strays_in_row_ >= adrift_from; }
  // How many records were left out because their time cannot be right.
  [[nodiscard]] std::uint64_t strays() const { return strays_; }

 private:
  static constexpr int adrift_from = 64;

  Tag* take(std::uint64_t record, Tag* out);
  [[nodiscard]] bool fits(std::uint64_t units, std::int64_t step) const;
  void count_stray(std::uint64_t record);
  bool is_possible(std::int64_t step) const;
  void begin_at(std::uint64_t units);

  std::optional<std::int64_t> reached_ps_;
  std::uint64_t latest_units_ = 0;  // time of the latest record, as the instrument gave it
  std::int64_t since_origin_ = 0;   // the same time, in units since the tags' time 0
  std::int64_t horizon_ps_ = std::numeric_limits<std::int64_t>::max();
  int strays_in_row_ = 0;
  int agreeing_strays_ = 0;        // the last strays in a row that agree with each other
  std::uint64_t stray_units_ = 0;  // time of the last stray, as the instrument gave it
  std::uint32_t internals_ = 0;  // a bit for each value of the internal bits that good records had
  std::uint64_t strays_ = 0;
};

}  // namespace splid::usb
