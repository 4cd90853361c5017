#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/ptu_header.hpp"
#include "protocol/tag.hpp"

namespace splid {

// Turns the records of a PTU recording in T2 mode into tags: photon (value: the record's channel),
// sync (special, channel 0) and marker (special, channel 1 to 15). Overflow records move the clock
// and give no tag; special records of any other channel are counted and left out.
//
// Times are origin_ps plus the record's time, exact where the resolution is a whole number of
// picoseconds; otherwise they are rounded to the nearest from an exact fraction, so that no error
// adds up.
//
// Threads: one. No allocation.
class PtuDecoder {
 public:
  static constexpr std::size_t record_bytes = 4;

  // resolution_s: seconds a time unit, 1e-15 to 1e-3.
  // Errors: Error(Fault::data) for a resolution outside that range and for a type of T3.
  PtuDecoder(PtuRecordType type, double resolution_s, std::int64_t origin_ps = 0);

  struct Progress {
    std::size_t bytes = 0;  // used, a whole number of records; a cut record is left over
    std::size_t tags = 0;   // written
  };

  // Decodes until either `records` or `out` is used up. `records` may start at any alignment. The
  // clock goes on from the last call. Elements of `out` past the tags written hold nothing of use.
  Progress decode(std::span<const std::byte> records, std::span<Tag> out);

  // How many records so far were no photon, sync, marker or overflow.
  [[nodiscard]] std::uint64_t unknown_records() const { return unknown_records_; }
  [[nodiscard]] std::uint64_t overflow_records() const { return overflow_records_; }
  // The clock at the last overflow, in the tags' time. No later tag is earlier than this.
  [[nodiscard]] std::int64_t reached_ps() const;

 private:
  [[nodiscard]] std::int64_t to_ps(std::int64_t ticks) const;
  void scale(std::span<Tag> tags) const;

  PtuRecordType type_;
  std::int64_t wrap_ = 0;       // ticks
  std::int64_t numerator_ = 1;  // ps a tick is numerator / denominator
  std::int64_t denominator_ = 1;
  std::int64_t origin_ps_;
  std::uint64_t base_ = 0;  // since time 0, in ps where the denominator is 1, else in ticks
  std::uint64_t unknown_records_ = 0;
  std::uint64_t overflow_records_ = 0;
};

}  // namespace splid
