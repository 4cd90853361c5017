#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocol/ptu_inputs.hpp"
#include "protocol/tag.hpp"

namespace splid {

// The record count that a header's number tells, or 0 where it tells none. A recorder that was
// stopped leaves 0, and another that counts in 32 bits a negative number.
constexpr std::uint64_t told_record_count(std::int64_t number) {
  return number > 0 ? static_cast<std::uint64_t>(number) : 0;
}

// The kinds of recordings that splid reads. protocol/recording_format.hpp tells them apart.
enum class RecordingFormat : std::uint8_t {
  ptu,           // PicoQuant, T2 and T3; what splid writes
  pico_harp,     // PicoQuant before PTU: .pt2, .pt3
  hydra_harp,    // PicoQuant before PTU: .ht2, .ht3
  qutag,         // qutools' binary: .qutag
  becker_hickl,  // FIFO files: .spc
};

// Whether the records are of one of PicoQuant's types.
constexpr bool is_pico_quant(RecordingFormat format) {
  return format == RecordingFormat::ptu || format == RecordingFormat::pico_harp ||
         format == RecordingFormat::hydra_harp;
}

// How the records of a PicoQuant recording are laid out; the values are those of a PTU header's
// TTResultFormat_TTTRRecType, whatever the format. The second byte is the mode.
enum class RecordType : std::uint32_t {
  pico_harp = 0x00010203,
  hydra_harp_v1 = 0x00010204,
  time_harp_260_nano = 0x00010205,
  time_harp_260_pico = 0x00010206,
  generic = 0x00010207,  // MultiHarp, PicoHarp 330 and later
  hydra_harp_v2 = 0x01010204,
  pico_harp_t3 = 0x00010303,
  hydra_harp_v1_t3 = 0x00010304,
  time_harp_260_nano_t3 = 0x00010305,
  time_harp_260_pico_t3 = 0x00010306,
  generic_t3 = 0x00010307,
  hydra_harp_v2_t3 = 0x01010304,
};

// T3: a record has the number of the last sync, and the time since that sync.
constexpr bool is_t3(RecordType type) {
  return (static_cast<std::uint32_t>(type) & 0xFF00U) == 0x0300U;
}

// T3: how many steps of the time since its sync a record can tell.
constexpr std::uint64_t t3_time_steps(RecordType type) {
  return type == RecordType::pico_harp_t3 ? 4096 : 32'768;
}

enum class PtuTagType : std::uint32_t {
  empty = 0xFFFF0008,
  boolean = 0x00000008,
  integer = 0x10000008,
  bit_set = 0x11000008,
  color = 0x12000008,
  real = 0x20000008,
  date_time = 0x21000008,  // days since 1899-12-30
  real_array = 0x2001FFFF,
  string = 0x4001FFFF,
  wide_string = 0x4002FFFF,
  blob = 0xFFFFFFFF,
};

// One entry of the header. The value is a string for the types string (up to its first NUL),
// real_array, wide_string and blob (the bytes as they are), a double for real and date_time, and an
// integer for all others.
struct PtuTag {
  std::string name;
  std::int32_t index = -1;  // -1: not one of several
  PtuTagType type = PtuTagType::empty;
  std::variant<std::int64_t, double, std::string> value = std::int64_t{0};
  std::size_t offset = 0;  // byte in the file where the entry starts

  friend bool operator==(const PtuTag&, const PtuTag&) = default;
};

// What the header of a recording says: every tag as it stands, and the values that decoding
// needs. What another format than PTU says is told by the tags that a PTU would say it with.
struct RecordingHeader {
  RecordingFormat format = RecordingFormat::ptu;
  std::vector<PtuTag> tags;  // in the file's order, Header_End left out
  // Of PicoQuant's formats alone.
  RecordType record_type = RecordType::hydra_harp_v2;
  // Syncs are counted, and a photon has the time since its sync, as in PicoQuant's mode T3.
  bool is_t3 = false;
  // Seconds a time unit of the records, 1e-15 to 1e-3; in T3, of the time since the last sync.
  double resolution_s = 0;
  double sync_period_s = 0;        // T3: between two syncs, 1e-12 to 1; else 0
  std::uint64_t time_steps = 0;    // T3: steps of a photon's time that a record can tell; else 0
  std::uint64_t record_count = 0;  // 0: not told; read up to the file's end
  std::size_t header_bytes = 0;    // records start here
  std::optional<double> created_unix_s;  // UTC, to a microsecond; time 0 of the records

  // A sentence for people on what the header says and splid does not follow; mostly empty.
  std::string warning;

  // splid's own facts, which have their defaults in the recordings of other programs.
  std::int64_t origin_ps = 0;  // tagger's clock at time 0 of the records
  PtuInputs inputs{0};         // of the records' channels, which have their own numbers elsewhere
  std::string pattern_json;    // empty: none
  std::string config_json;     // empty: none
  std::vector<Loss> losses;    // tagger's clock, sorted; begin == end: no interval known

  // The tag of that name and index; null where there is none.
  [[nodiscard]] const PtuTag* find(std::string_view name, std::int32_t index = -1) const;
  // The value of a tag; absent where there is none, and where the tag is of another type.
  [[nodiscard]] std::optional<std::int64_t> integer(std::string_view name) const;
  [[nodiscard]] std::optional<double> real(std::string_view name) const;
  [[nodiscard]] std::optional<std::string> text(std::string_view name) const;
};

}  // namespace splid
