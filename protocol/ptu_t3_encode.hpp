#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "protocol/loss_collector.hpp"
#include "protocol/tag.hpp"

namespace splid {

// Turns the tags of a T3 recording, as its decoder gives them, into records of a PTU in T3 mode,
// type hydra_harp_v2_t3 (0x01010304): the number of a photon's sync and its time since that sync
// stay as they were measured.
//
// A `missed` tag, a photon that came too late after its sync, becomes a record of its input and of
// the largest time.
// Losses go to losses(), for the header. A tag that no record can hold goes there as `missed`: an
// input above 63, a time before its sync, or a sync before the last overflow record.
//
// Threads: one. Errors: none. Allocates only where the caller's buffer has to grow.
class PtuT3Encoder {
 public:
  // period_ps: between the tags' syncs, a whole number of at least 1; step_ps: of the records' time
  // since a sync.
  PtuT3Encoder(std::int64_t period_ps, double step_ps);

  // Takes tags and appends their records.
  void encode(std::span<const Tag> tags, std::vector<std::byte>& out);

  [[nodiscard]] std::uint64_t records() const { return records_; }    // overflows included
  [[nodiscard]] std::uint64_t rejected() const { return rejected_; }  // tags that got no record
  [[nodiscard]] const LossCollector& losses() const { return losses_; }

 private:
  void put(const Tag& tag, std::vector<std::byte>& out);
  void reject(std::int64_t time_ps);
  void append(std::uint32_t record, std::vector<std::byte>& out);

  std::int64_t period_ps_;
  double step_ps_;
  std::int64_t sync_ps_ = 0;     // of the last sync tag
  std::uint64_t overflows_ = 0;  // written
  std::uint64_t records_ = 0;
  std::uint64_t rejected_ = 0;
  LossCollector losses_;
};

}  // namespace splid
