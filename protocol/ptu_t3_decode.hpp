#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/counted_syncs.hpp"
#include "protocol/record_decoder.hpp"
#include "protocol/recording_header.hpp"
#include "protocol/tag.hpp"

namespace splid {

// Turns the records of a PTU recording in T3 mode into tags. Such a record has the number of the
// last sync before the photon, and the photon's time since that sync. The syncs are the starts of
// the pattern, so that their number counts pattern periods: the times that come out are in the
// generator's own clock, in which each pattern period has the same length.
//
//  - Sync k is at k periods. A sync tag comes before the first photon or marker of its period, and
//    no sync tag in a period without any. These syncs were not measured: they say where the pattern
//    is, and nothing of its drift and jitter (SourceInfo::syncs_are_counted).
//  - A photon whose time since its sync is the largest that a record can hold may have come at any
//    later time; it becomes a `missed` tag (untimed_photon()) and is counted as saturated.
//  - Overflow records move the number on and give no tag; special records of channel 0 are counted
//    as unknown and left out.
//
// Source: PicoQuant's description of the unified TTTR file format. Threads: one. No allocation.
class PtuT3Decoder final : public RecordDecoder {
 public:
  // type: one of T3. period_ps: the pattern period, 1 ps to 1 s. resolution_s: a unit of a
  // photon's time since its sync, 1e-15 to 1e-3 s. Errors: Error(Fault::data) for values outside.
  PtuT3Decoder(RecordType type, double period_ps, double resolution_s);

  [[nodiscard]] std::size_t record_bytes() const override { return ptu_record_bytes; }
  Progress decode(std::span<const std::byte> records, std::span<Tag> out) override;
  [[nodiscard]] std::uint64_t unknown_records() const override { return state_.unknown; }
  [[nodiscard]] std::uint64_t overflow_records() const override { return state_.overflows; }
  // Photons whose time since their sync was the largest that a record can hold.
  [[nodiscard]] std::uint64_t saturated_photons() const override { return state_.saturated; }
  // When the last sync that was counted came.
  [[nodiscard]] std::int64_t reached_ps() const override;

 private:
  static constexpr std::uint64_t no_sync = ~std::uint64_t{0};  // no recording has as many

  struct State {
    std::uint64_t base = 0;        // number of the sync at the last overflow
    std::uint64_t told = no_sync;  // number of the last sync that became a tag
    std::uint64_t unknown = 0;     // records
    std::uint64_t overflows = 0;   // records
    std::uint64_t saturated = 0;   // photons
  };

  // Decodes so many records, with room in `out` for two tags of each; the number of tags.
  std::size_t decode_records(const std::byte* in, std::size_t count, Tag* out);
  template <class Format>
  std::size_t decode_some(const std::byte* in, std::size_t count, Tag* out);
  template <class Format>
  std::size_t decode_mixed(const std::byte* in, std::size_t count, Tag* out);

  RecordType type_;
  CountedSyncs clock_;
  double tick_ps_;
  std::uint64_t most_ticks_;  // the largest time since a sync
  State state_;
  std::optional<Tag> waiting_;  // an event for which there was no room
};

}  // namespace splid
