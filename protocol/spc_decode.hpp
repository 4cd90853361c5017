#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "protocol/counted_syncs.hpp"
#include "protocol/record_decoder.hpp"
#include "protocol/recording_header.hpp"

namespace splid {

// Becker & Hickl's FIFO files (.spc) of records of 4 bytes, as all modules but the SPC-600 and
// SPC-630 write them. The first 4 bytes say how long a step of the macro time is, and nothing in
// the file says how long a step of the micro time is: that stands in the settings file (.set) that
// the maker's program saves beside it, as SP_TAC_R / SP_TAC_G over 4096 steps.
//
// The macro time counts syncs where the module's macro clock was its sync input, and only then can
// a photon be placed within the pattern. The micro time is measured from the photon to the next
// sync ("reversed start-stop"), so that 4095 less the record's number rises with the delay, from an
// offset that cables make.
//
// Source: The bh TCSPC Handbook, "FIFO Files" in the chapter on data file structure.
//
// prefix: the file's first bytes. settings: the text of the settings file.
// Errors: Error(Fault::data) for a file too short, a macro clock of 0, settings that do not give
// the range and the gain.
std::optional<RecordingHeader> parse_spc_header(std::span<const std::byte> prefix, bool complete,
                                                std::string_view settings);

// The records of such a file. Syncs, photons and markers become tags as those of PicoQuant's T3
// mode do (PtuT3Decoder). Where the module lost photons (a record's GAP bit), a loss reaches from
// the event before to the record's event. A photon without a valid micro time is a `missed` tag
// (untimed_photon()).
//
// Threads: one. No allocation.
class SpcDecoder final : public RecordDecoder {
 public:
  // period_ps: the pattern period, 1 ps to 1 s. resolution_s: a step of the micro time.
  // Errors: Error(Fault::data) for values outside.
  SpcDecoder(double period_ps, double resolution_s);

  [[nodiscard]] std::size_t record_bytes() const override { return 4; }
  Progress decode(std::span<const std::byte> records, std::span<Tag> out) override;
  [[nodiscard]] std::uint64_t unknown_records() const override { return state_.unknown; }
  [[nodiscard]] std::uint64_t overflow_records() const override { return state_.overflow_records; }
  // Photons whose micro time the module marked as invalid.
  [[nodiscard]] std::uint64_t saturated_photons() const override { return state_.untimed; }
  // When the last sync that was counted came.
  [[nodiscard]] std::int64_t reached_ps() const override { return clock_.time_ps(state_.syncs); }

 private:
  static constexpr std::uint64_t no_sync = ~std::uint64_t{0};  // no recording has as many

  // Where the records have got to.
  struct State {
    std::uint64_t base = 0;        // number of the sync at the last overflow
    std::uint64_t syncs = 0;       // number of the last sync
    std::uint64_t told = no_sync;  // number of the last sync that became a tag
    std::int64_t last_ps = 0;      // time of the last event
    std::uint64_t unknown = 0;
    std::uint64_t overflow_records = 0;
    std::uint64_t untimed = 0;
  };

  // The tags of so many records, of which there may be four a record. Returns their number.
  std::size_t decode_some(const std::byte* in, std::size_t count, Tag* out);
  std::size_t decode_mixed(const std::byte* in, std::size_t count, Tag* out);

  CountedSyncs clock_;
  double step_ps_;
  State state_;
  std::array<Tag, 4> made_{};  // the tags of a record, of which those before taken_ are out
  std::size_t made_count_ = 0;
  std::size_t taken_ = 0;
};

}  // namespace splid
