#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/ptu_inputs.hpp"
#include "protocol/record_decoder.hpp"
#include "protocol/recording_header.hpp"
#include "protocol/tag.hpp"

namespace splid {

// Turns the records of a PTU recording in T2 mode into tags: photon (value: the channel's input),
// sync (special, channel 0) and marker (special, channel 1 to 15). Overflow records move the clock
// and give no tag; special records of any other channel are counted and left out.
//
// Times are origin_ps plus the record's time, exact where the resolution is a whole number of
// picoseconds; otherwise they are rounded to the nearest from an exact fraction, so that no error
// adds up.
//
// Threads: one. No allocation.
class PtuDecoder final : public RecordDecoder {
 public:
  // resolution_s: seconds a time unit, 1e-15 to 1e-3.
  // Errors: Error(Fault::data) for a resolution outside that range and for a type of T3.
  PtuDecoder(RecordType type, double resolution_s, std::int64_t origin_ps = 0,
             const PtuInputs& inputs = PtuInputs());

  [[nodiscard]] std::size_t record_bytes() const override { return ptu_record_bytes; }
  Progress decode(std::span<const std::byte> records, std::span<Tag> out) override;
  // How many records so far were no photon, sync, marker or overflow.
  [[nodiscard]] std::uint64_t unknown_records() const override { return unknown_records_; }
  [[nodiscard]] std::uint64_t overflow_records() const override { return overflow_records_; }
  // The clock at the last overflow, in the tags' time. No later tag is earlier than this.
  [[nodiscard]] std::int64_t reached_ps() const override;

 private:
  [[nodiscard]] std::int64_t to_ps(std::int64_t ticks) const;
  // Decodes so many records, with room in `out` for a tag of each; the number of tags.
  std::size_t decode_some(const std::byte* in, std::size_t count, Tag* out);
  void name_inputs(std::span<Tag> tags) const;
  // Ticks become ps. first_ticks: the clock before the tags.
  void scale(std::span<Tag> tags, std::uint64_t first_ticks) const;

  RecordType type_;
  PtuInputs inputs_;
  bool has_other_inputs_;       // than the channels' numbers
  std::int64_t wrap_ = 0;       // ticks
  std::int64_t numerator_ = 1;  // ps a tick is numerator / denominator
  std::int64_t denominator_ = 1;
  std::uint64_t whole_ps_ = 0;  // a tick, and the rest of it and the half that rounds, in 2^-64 ps
  std::uint64_t fraction_ = 0;
  std::uint64_t half_ = 0;
  std::int64_t origin_ps_;
  std::uint64_t base_ = 0;  // since time 0, in ps where the denominator is 1, else in ticks
  std::uint64_t unknown_records_ = 0;
  std::uint64_t overflow_records_ = 0;
};

}  // namespace splid
