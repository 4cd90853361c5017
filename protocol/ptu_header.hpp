#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocol/tag.hpp"

namespace splid {

inline constexpr std::string_view ptu_magic = "PQTTTR";         // a file's first bytes
inline constexpr std::string_view ptu_end_name = "Header_End";  // the tag that ends a header

// How the records of a recording are laid out; the values are those of the header's
// TTResultFormat_TTTRRecType. The second byte is the mode.
enum class PtuRecordType : std::uint32_t {
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
constexpr bool is_t3(PtuRecordType type) {
  return (static_cast<std::uint32_t>(type) & 0xFF00U) == 0x0300U;
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
// needs.
struct PtuHeader {
  std::vector<PtuTag> tags;  // in the file's order, Header_End left out
  PtuRecordType record_type = PtuRecordType::hydra_harp_v2;
  // Seconds a time unit of the records, 1e-15 to 1e-3; in T3, of the time since the last sync.
  double resolution_s = 0;
  double sync_period_s = 0;              // T3: between two syncs, 1e-12 to 1; else 0
  std::uint64_t record_count = 0;        // 0: recorder was stopped; read up to the file's end
  std::size_t header_bytes = 0;          // records start here
  std::optional<double> created_unix_s;  // UTC, to a microsecond; time 0 of the records

  // splid's own facts, which have their defaults in the recordings of other programs.
  std::int64_t origin_ps = 0;  // tagger's clock at time 0 of the records
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

// Reads a header from the first bytes of a recording. Absent where the header goes on past
// `prefix`: call it again with more bytes. `complete` says that there are no more, so that a cut
// header is an error.
//
// Errors: Error(Fault::data) with the byte offset, for a file that is no PTU, a cut header, an
// unknown record type and values that make no sense.
std::optional<PtuHeader> parse_ptu_header(std::span<const std::byte> prefix, bool complete);

// What make_ptu_header() writes into a header. Strings are cut at their first NUL.
struct PtuFacts {
  double created_unix_s = 0;         // UTC at origin_ps, to a microsecond
  std::int64_t origin_ps = 0;        // tagger's clock at time 0 of the records
  std::uint64_t record_count = 0;    // in the file
  std::int64_t acquisition_ms = 0;   // length of the recording
  std::int64_t sync_rate_hz = 0;     // mean; 0: not known
  std::string instrument = "splid";  // HW_Type
  std::string release = "0.0.0";     // of the program: CreatorSW_Version
  std::string comment = "T2 Mode";   // File_Comment
  std::string guid;                  // empty: made from created_unix_s and origin_ps
  std::string pattern_json;          // Splid_Pattern
  std::string config_json;           // Splid_Config
  std::string encoder_file;          // Splid_Encoder: the file beside this with counts; empty: none
  std::vector<Loss> losses;          // Splid_Losses, sorted; neighbours are joined until all fit
  std::size_t losses_room_bytes = 65'536;  // fixed room for the losses, at least 128
};

// The bytes of a header for records of PtuEncoder: type hydra_harp_v2, 1 ps. Their number depends
// only on the lengths of the strings and on losses_room_bytes, so that the header of a running
// recording can be written over in place as the record count and the losses become known.
//
// Errors: Error(Fault::data) where a string holds the words Header_End, which readers search for.
std::vector<std::byte> make_ptu_header(const PtuFacts& facts);

// The offset of the record count in such a header, so that the count alone can be written over as
// the file grows: 8 bytes, little endian, which are never on two pages.
constexpr std::size_t ptu_record_count_at(std::size_t header_bytes) { return header_bytes - 56; }
// Sets the record count. header: made by make_ptu_header().
void set_ptu_record_count(std::span<std::byte> header, std::uint64_t count);

}  // namespace splid
