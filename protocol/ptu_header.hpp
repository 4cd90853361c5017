#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/ptu_inputs.hpp"
#include "protocol/recording_header.hpp"
#include "protocol/scan_lines.hpp"
#include "protocol/tag.hpp"

namespace splid {

inline constexpr std::string_view ptu_magic = "PQTTTR";         // a file's first bytes
inline constexpr std::string_view ptu_end_name = "Header_End";  // the tag that ends a header

// Reads a header from the first bytes of a recording. Absent where the header goes on past
// `prefix`: call it again with more bytes. `complete` says that there are no more, so that a cut
// header is an error.
//
// Errors: Error(Fault::data) with the byte offset, for a file that is no PTU, a cut header, an
// unknown record type and values that make no sense.
std::optional<RecordingHeader> parse_ptu_header(std::span<const std::byte> prefix, bool complete);

// What the header of a recording in T3 mode has beyond those of T2.
struct PtuT3Facts {
  double sync_period_s = 0;  // between two syncs
  double resolution_s = 0;   // of the times since a sync
};

// What make_ptu_header() writes into a header. Strings are cut at their first NUL.
struct PtuFacts {
  double created_unix_s = 0;         // UTC at origin_ps, to a microsecond
  std::int64_t origin_ps = 0;        // tagger's clock at time 0 of the records
  std::uint64_t record_count = 0;    // in the file
  std::int64_t acquisition_ms = 0;   // length of the recording
  std::int64_t sync_rate_hz = 0;     // mean; 0: not known
  std::int64_t sync_divider = 1;     // HWSync_Divider: of so many syncs one was recorded
  std::string instrument = "splid";  // HW_Type
  std::string release = "0.0.0";     // of the program: CreatorSW_Version
  std::string comment = "T2 Mode";   // File_Comment
  PtuInputs inputs{1};               // Splid_Inputs; has a fixed room
  std::string guid;                  // empty: made from created_unix_s and origin_ps
  std::string pattern_json;          // Splid_Pattern
  std::string config_json;           // Splid_Config
  std::string encoder_file;          // Splid_Encoder: the file beside this with counts; empty: none
  std::vector<Loss> losses;          // Splid_Losses, sorted; neighbours are joined until all fit
  std::optional<ScanLines> scan;     // ImgHdr_ tags, where it has lines from marker to marker
  std::optional<PtuT3Facts> t3;      // records of PtuT3Encoder; absent: of PtuEncoder
  std::size_t losses_room_bytes = 65'536;  // fixed room for the losses, at least 128
};

// The bytes of a header for records of PtuEncoder (type hydra_harp_v2, 1 ps) or of PtuT3Encoder
// (type hydra_harp_v2_t3). Their number depends
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
