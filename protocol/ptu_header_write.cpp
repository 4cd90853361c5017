#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>

#include "protocol/error.hpp"
#include "protocol/ptu_header.hpp"
#include "protocol/ptu_losses.hpp"

namespace splid {
namespace {

constexpr std::string_view ptu_version = "1.0.00";
constexpr std::size_t origin_room_bytes = 24;  // 20 characters of a 64-bit number and a NUL

class Writer {
 public:
  Writer() {
    padded(ptu_magic, 8);
    padded(ptu_version, 8);
  }

  void integer(std::string_view name, std::int64_t value) {
    entry(name, PtuTagType::integer, static_cast<std::uint64_t>(value));
  }
  void real(std::string_view name, double value) {
    entry(name, PtuTagType::real, std::bit_cast<std::uint64_t>(value));
  }
  void date_time(std::string_view name, double unix_s) {
    entry(name, PtuTagType::date_time, std::bit_cast<std::uint64_t>(unix_s / 86'400 + 25'569));
  }
  // Padded with NULs to a multiple of 8 bytes, at least one NUL and at least room_bytes in all.
  void string(std::string_view name, std::string_view value, std::size_t room_bytes = 0) {
    value = value.substr(0, value.find('\0'));
    if (value.find(ptu_end_name) != std::string_view::npos) {
      throw Error(Fault::data, "PTU header: the text of " + std::string(name) +
                                   " holds the words Header_End, which readers take for the "
                                   "header's end; rename what they name");
    }
    const std::size_t bytes = (std::max(value.size() + 1, room_bytes) + 7) / 8 * 8;
    entry(name, PtuTagType::string, bytes);
    padded(value, bytes);
  }
  std::vector<std::byte> finish() {
    entry(ptu_end_name, PtuTagType::empty, 0);
    return std::move(bytes_);
  }

 private:
  void entry(std::string_view name, PtuTagType type, std::uint64_t word) {
    padded(name, 32);
    little_endian(0xFFFFFFFF, 4);  // index -1: not one of several
    little_endian(static_cast<std::uint32_t>(type), 4);
    little_endian(word, 8);
  }
  void padded(std::string_view text, std::size_t bytes) {
    for (const char c : text) bytes_.push_back(static_cast<std::byte>(c));
    bytes_.insert(bytes_.end(), bytes - text.size(), std::byte{0});
  }
  void little_endian(std::uint64_t value, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; ++i) {
      bytes_.push_back(static_cast<std::byte>((value >> (8 * i)) & 0xFFU));
    }
  }

  std::vector<std::byte> bytes_;
};

// Readers want a GUID but compare it with nothing. It is made from the facts of the recording, so
// that a simulated file repeats itself byte for byte. The constants are those of FNV-1a with 64
// bits.
std::string guid_of(const PtuFacts& facts) {
  std::uint64_t hash = 0xCBF29CE484222325;
  const auto mix = [&hash](std::uint64_t value) {
    for (unsigned shift = 0; shift < 64; shift += 8) {
      hash = (hash ^ ((value >> shift) & 0xFFU)) * 0x100000001B3;
    }
    return hash;
  };
  const std::uint64_t high = mix(std::bit_cast<std::uint64_t>(facts.created_unix_s));
  const std::uint64_t low = mix(static_cast<std::uint64_t>(facts.origin_ps));
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "{%08X-%04X-%04X-%04X-%012llX}",
                static_cast<unsigned>(high >> 32U), static_cast<unsigned>(high >> 16U & 0xFFFFU),
                static_cast<unsigned>(
                    0x8000U | (high & 0xFFFU)),  // version 8: made in a way of the maker's own
                static_cast<unsigned>(0x8000U | (low >> 48U & 0x3FFFU)),
                static_cast<unsigned long long>(low & 0xFFFFFFFFFFFF));
  return text.data();
}

void write_origin(Writer& writer, const PtuFacts& facts) {
  writer.string("File_GUID", facts.guid.empty() ? guid_of(facts) : facts.guid);
  writer.string("CreatorSW_Name", "splid");
  writer.string("CreatorSW_Version", facts.release);
  writer.date_time("File_CreatingTime", facts.created_unix_s);
  writer.string("File_Comment", facts.comment);
  writer.string("HW_Type", facts.instrument);
}

// Lines from one marker to another, each of a single bit: other readers know no others.
bool is_picture(const std::optional<ScanLines>& scan) {
  return scan && marker_number(scan->start) != 0 && marker_number(scan->stop) != 0 &&
         (scan->start != scan->stop || scan->pixels > 1);
}

void write_measurement(Writer& writer, const PtuFacts& facts) {
  const RecordType type = facts.t3 ? RecordType::hydra_harp_v2_t3 : RecordType::hydra_harp_v2;
  const double clock_s = facts.t3 ? facts.t3->sync_period_s : 1e-12;
  writer.integer("Measurement_Mode", facts.t3 ? 3 : 2);
  writer.integer("Measurement_SubMode", is_picture(facts.scan) ? 3 : 0);
  writer.integer("TTResultFormat_TTTRRecType", static_cast<std::int64_t>(type));
  writer.integer("TTResultFormat_BitsPerRecord", 32);
  writer.integer("MeasDesc_BinningFactor", 1);
  writer.integer("MeasDesc_AcquisitionTime", facts.acquisition_ms);
  writer.real("MeasDesc_Resolution", facts.t3 ? facts.t3->resolution_s : 1e-12);
  writer.real("MeasDesc_GlobalResolution", clock_s);
  if (facts.t3 || facts.sync_divider != 1) {
    writer.integer("HWSync_Divider", facts.sync_divider);
  }
  writer.integer("TTResult_SyncRate", facts.sync_rate_hz);
}

void write_scan(Writer& writer, const ScanLines& scan) {
  writer.integer("ImgHdr_Dimensions", 3);
  writer.integer("ImgHdr_Ident", 3);  // a laser scanner with line markers
  writer.integer("ImgHdr_PixX", scan.pixels);
  if (scan.lines > 0) writer.integer("ImgHdr_PixY", scan.lines);
  writer.integer("ImgHdr_LineStart", marker_number(scan.start));
  if (scan.stop != scan.start) writer.integer("ImgHdr_LineStop", marker_number(scan.stop));
  const std::int64_t picture = marker_number(scan.picture);
  if (picture != 0) writer.integer("ImgHdr_Frame", picture);
  writer.integer("ImgHdr_BiDirect", scan.both_ways ? 1 : 0);
  writer.integer("ImgHdr_SinCorrection", std::llround(scan.sine_percent));
}

}  // namespace

std::vector<std::byte> make_ptu_header(const PtuFacts& facts) {
  Writer writer;
  write_origin(writer, facts);
  write_measurement(writer, facts);
  if (is_picture(facts.scan)) write_scan(writer, *facts.scan);
  writer.string("Splid_Origin_ps", std::to_string(facts.origin_ps), origin_room_bytes);
  if (!facts.t3) writer.string("Splid_Inputs", facts.inputs.text(), PtuInputs::most_chars);
  writer.string("Splid_Pattern", facts.pattern_json);
  writer.string("Splid_Config", facts.config_json);
  if (!facts.encoder_file.empty()) writer.string("Splid_Encoder", facts.encoder_file);
  const std::size_t room_bytes = std::max<std::size_t>(facts.losses_room_bytes, 128);
  writer.string("Splid_Losses", losses_to_text(facts.losses, room_bytes - 1), room_bytes);
  // The record count is the last entry: see ptu_record_count_at().
  writer.integer("TTResult_NumberOfRecords", static_cast<std::int64_t>(facts.record_count));
  return writer.finish();
}

void set_ptu_record_count(std::span<std::byte> header, std::uint64_t count) {
  const auto place = header.subspan(ptu_record_count_at(header.size()), 8);
  for (std::byte& byte : place) {
    byte = static_cast<std::byte>(count & 0xFFU);
    count >>= 8U;
  }
}

}  // namespace splid
