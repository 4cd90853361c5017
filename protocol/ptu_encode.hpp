#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/loss_collector.hpp"
#include "protocol/ptu_inputs.hpp"
#include "protocol/tag.hpp"

namespace splid {

// How many of the records that PtuEncoder made stand for a tag: all but overflows. A last record
// that is cut off does not count.
std::uint64_t ptu_tags(std::span<const std::byte> records);

// How far a tag may come before the latest tag and still be sorted.
inline constexpr std::int64_t ptu_sorted_within_ps = 1'000'000;
// How far a tag may come after the latest tag and still be written at its time.
//
// Design note: a day is 20 million overflow records, 81 MB; one wrong time stamp must not fill the
// disk, at up to 8.7 GB.
inline constexpr std::int64_t ptu_longest_step_ps = 86'400'000'000'000'000;

// Turns tags into records of a PTU recording: T2 mode, type hydra_harp_v2 (0x01010204), 1 ps.
// Records are written sorted: tags wait in a small buffer until the stream is 1 us past them.
//
// Takes photons of at most 64 inputs, syncs and markers 1 to 15. Heartbeats only move the clock.
// Losses go to losses(), for the header. So does, as `missed`, each tag that no record
// can hold: a tag that comes after a later tag was written (more than 1 us too late), a tag before
// origin_ps, a marker of other bits, and a photon of a 65th input. A tag after the clock was set
// anew (clock_break), or more than a day ahead of all tags before it, is written 1 s after the last
// record. The gap is a loss of unknown count. So a recording's time never runs backwards, but its
// later tags no longer show the tagger's clock.
//
// Threads: one. Errors: none. Allocates only where the caller's buffer has to grow.
class PtuEncoder {
 public:
  // origin_ps: tagger's clock at time 0 of the recording. inputs: those that have a channel
  // already.
  explicit PtuEncoder(std::int64_t origin_ps, const PtuInputs& inputs = PtuInputs());

  // Takes tags, and appends the records of all tags that no later tag can precede.
  void encode(std::span<const Tag> tags, std::vector<std::byte>& out);
  // Appends the records that still wait. Tags that come before them afterwards are late.
  void flush(std::vector<std::byte>& out);

  [[nodiscard]] std::uint64_t records() const { return records_; }    // written, overflows included
  [[nodiscard]] std::uint64_t tags() const { return tags_; }          // written
  [[nodiscard]] std::uint64_t rejected() const { return rejected_; }  // tags that got no record
  // Which inputs the records' channels stand for; grows as photons of new inputs come.
  [[nodiscard]] const PtuInputs& inputs() const { return inputs_; }
  // The losses, in the recording's clock: see now_ps().
  [[nodiscard]] const LossCollector& losses() const { return losses_; }
  // The latest time so far, in the recording's clock, which is the tags' clock up to the first
  // clock break.
  [[nodiscard]] std::int64_t now_ps() const { return now_ps_; }

 private:
  struct Waiting {
    std::int64_t time_ps;
    std::uint32_t record;  // without its time
  };

  void take(Tag tag, std::vector<std::byte>& out);
  [[nodiscard]] std::int64_t in_recording(std::int64_t time_ps) const;
  void restart(std::int64_t time_ps, std::vector<std::byte>& out);
  [[nodiscard]] std::optional<std::uint32_t> record_of(const Tag& tag);
  void reject(std::int64_t time_ps);
  void insert(Waiting waiting, std::vector<std::byte>& out);
  void write_until(std::int64_t time_ps, std::vector<std::byte>& out);
  void write(const Waiting& waiting, std::vector<std::byte>& out);
  void append(std::uint32_t record, std::vector<std::byte>& out);

  PtuInputs inputs_;
  // The same moment, in the tags' clock since the last clock break and in the recording's.
  std::int64_t clock_zero_ps_ = 0;
  std::int64_t recording_zero_ps_ = 0;
  std::int64_t now_ps_;
  std::int64_t written_ps_;  // time of the last record
  std::int64_t base_ps_;     // recording's clock at the last overflow
  std::uint64_t records_ = 0;
  std::uint64_t tags_ = 0;
  std::uint64_t rejected_ = 0;
  bool clock_broke_ = false;
  std::vector<Waiting> waiting_;  // sorted by time
  std::size_t first_waiting_ = 0;
  LossCollector losses_;
};

}  // namespace splid
