#include "protocol/recording_format.hpp"

#include <algorithm>
#include <array>
#include <cctype>

#include "protocol/pico_quant_header.hpp"
#include "protocol/ptu_decode.hpp"
#include "protocol/ptu_header.hpp"
#include "protocol/ptu_t3_decode.hpp"
#include "protocol/qutag_decode.hpp"
#include "protocol/spc_decode.hpp"

namespace splid {
namespace {

using Prefix = std::span<const std::byte>;
using Parse = std::optional<RecordingHeader> (*)(Prefix, bool complete, std::string_view settings);

template <std::optional<RecordingHeader> parse(Prefix, bool)>
constexpr Parse without_settings =
    [](Prefix prefix, bool complete, std::string_view) { return parse(prefix, complete); };

struct FormatLine {
  RecordingFormat format;
  std::string_view words;
  std::string_view mark;    // the file's first bytes; empty: any
  std::string_view ending;  // of its name, in small letters, where there is no mark
  std::string_view settings_ending;
  Parse parse;
};

constexpr std::array formats = {
    FormatLine{RecordingFormat::ptu, "a PTU recording", ptu_magic, "", "",
               without_settings<parse_ptu_header>},
    FormatLine{RecordingFormat::pico_harp, "a PicoHarp recording (.pt2, .pt3)", "PicoHarp", "", "",
               without_settings<parse_pico_harp_header>},
    FormatLine{RecordingFormat::hydra_harp, "a HydraHarp recording (.ht2, .ht3)", "HydraHarp", "",
               "", without_settings<parse_hydra_harp_header>},
    FormatLine{RecordingFormat::qutag, "a quTAG recording", "", ".qutag", "",
               without_settings<parse_qutag_header>},
    FormatLine{RecordingFormat::becker_hickl, "a Becker & Hickl recording (.spc)", "", ".spc",
               ".set", parse_spc_header},
};

constexpr std::array<std::string_view, 7> known_endings = {".ptu", ".pt2",   ".pt3", ".ht2",
                                                           ".ht3", ".qutag", ".spc"};

const FormatLine& line_of(RecordingFormat format) {
  return *std::find_if(formats.begin(), formats.end(),
                       [=](const FormatLine& line) { return line.format == format; });
}

bool ends_with(std::string_view name, std::string_view ending) {
  const auto same = [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; };
  return name.size() >= ending.size() &&
         std::equal(ending.begin(), ending.end(), name.end() - static_cast<long>(ending.size()),
                    [&](char b, char a) { return same(a, b); });
}

}  // namespace

std::optional<RecordingFormat> format_of(std::string_view start, std::string_view name) {
  for (const FormatLine& line : formats) {
    if (!line.mark.empty() && start.starts_with(line.mark)) return line.format;
  }
  for (const FormatLine& line : formats) {
    if (line.mark.empty() && ends_with(name, line.ending)) return line.format;
  }
  return std::nullopt;
}

std::string_view in_words(RecordingFormat format) { return line_of(format).words; }

std::string_view settings_ending(RecordingFormat format) { return line_of(format).settings_ending; }

std::optional<RecordingHeader> parse_recording_header(RecordingFormat format,
                                                      std::span<const std::byte> prefix,
                                                      bool complete, std::string_view settings) {
  return line_of(format).parse(prefix, complete, settings);
}

bool counts_records(RecordingFormat format) {
  return format != RecordingFormat::qutag && format != RecordingFormat::becker_hickl;
}

std::unique_ptr<RecordDecoder> make_decoder(const RecordingHeader& header, double period_ps) {
  const double sync_ps = period_ps > 0 ? period_ps : header.sync_period_s * 1e12;
  switch (header.format) {
    case RecordingFormat::qutag:
      return std::make_unique<QutagDecoder>();
    case RecordingFormat::becker_hickl:
      return std::make_unique<SpcDecoder>(sync_ps, header.resolution_s);
    case RecordingFormat::ptu:
    case RecordingFormat::pico_harp:
    case RecordingFormat::hydra_harp:
      break;
  }
  if (header.is_t3) {
    return std::make_unique<PtuT3Decoder>(header.record_type, sync_ps, header.resolution_s);
  }
  return std::make_unique<PtuDecoder>(header.record_type, header.resolution_s, header.origin_ps,
                                      header.inputs);
}

std::span<const std::string_view> recording_endings() { return known_endings; }

bool is_named_as_recording(std::string_view name) {
  return std::any_of(known_endings.begin(), known_endings.end(),
                     [=](std::string_view ending) { return ends_with(name, ending); });
}

}  // namespace splid
