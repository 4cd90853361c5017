#include "protocol/file_kind.hpp"

#include <algorithm>
#include <array>
#include <cctype>

namespace splid {
namespace {

using namespace std::string_view_literals;

struct Mark {
  std::string_view bytes;  // at the file's start, or its name's ending, in small letters
  FileKind kind;
};

constexpr std::string_view as_t2 =
    "save the measurement as PTU in T2 mode with the maker's program";

constexpr std::array marks = {
    Mark{"PQTTTR"sv, recording_file_kind},
    Mark{"PQHISTO"sv,
         {"a PicoQuant histogram (PHU), which holds counts and no photons",
          "record the measurement as PTU in T2 mode"}},
    Mark{"PicoHarp"sv, {"a PicoQuant file of the kind before PTU (.pt2, .pt3, .phd)", as_t2}},
    Mark{"HydraHarp"sv, {"a PicoQuant file of the kind before PTU (.ht2, .ht3, .hhd)", as_t2}},
    Mark{"TimeHarp"sv, {"a PicoQuant file of the kind before PTU (.t3r, .thd)", as_t2}},
    Mark{"\x89HDF\r\n\x1a\n"sv, {"an HDF5 file", "export its photons as PTU in T2 mode"}},
    Mark{"\x1f\x8b"sv, {"a gzip archive", "unpack it first, with gunzip"}},
    Mark{"\xfd"
         "7zXZ\0"sv,
         {"an xz archive", "unpack it first, with unxz"}},
    Mark{"\x28\xb5\x2f\xfd"sv, {"a zstd archive", "unpack it first, with unzstd"}},
    Mark{"BZh"sv, {"a bzip2 archive", "unpack it first, with bunzip2"}},
    Mark{"PK\x03\x04"sv, {"a ZIP archive", "unpack it first, with unzip"}},
};

// Formats that have no mark at their start that could be relied on.
constexpr std::array endings = {
    Mark{".ttbin"sv,
         {"a Swabian Time Tagger file by its name",
          "read it with Swabian's library and send its tags through a bridge (docs/instruments)"}},
    Mark{".spc"sv, {"a Becker & Hickl file by its name", "export its photons as PTU in T2 mode"}},
    Mark{".t3r"sv, {"a PicoQuant file of the kind before PTU by its name", as_t2}},
    Mark{".ht2"sv, {"a PicoQuant file of the kind before PTU by its name", as_t2}},
    Mark{".phu"sv,
         {"a PicoQuant histogram by its name", "record the measurement as PTU in T2 mode"}},
    Mark{".h5"sv, {"an HDF5 file by its name", "export its photons as PTU in T2 mode"}},
};

std::string_view skip(std::string_view text, std::string_view what) {
  const std::size_t first = text.find_first_not_of(what);
  return first == std::string_view::npos ? std::string_view{} : text.substr(first);
}

// The value of "schema", wherever it stands: a file with a slip in it is of its kind still.
std::string_view schema_of(std::string_view text) {
  constexpr std::string_view key = "\"schema\"";
  const std::size_t at = text.find(key);
  if (at == std::string_view::npos) return {};
  text = skip(text.substr(at + key.size()), " \t\r\n:");
  if (!text.starts_with('"')) return {};
  return text.substr(1, text.find('"', 1) - 1);
}

std::string lower(std::string_view text) {
  std::string all(text);
  std::transform(all.begin(), all.end(), all.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return all;
}

}  // namespace

std::optional<FileKind> kind_of_file(std::string_view start, std::string_view name) {
  for (const Mark& mark : marks) {
    if (start.starts_with(mark.bytes)) return mark.kind;
  }
  const std::string_view schema = schema_of(start);
  if (schema == "splid.config") return config_file_kind;
  if (schema == "splid.pattern") return pattern_file_kind;
  if (schema == "splid.truth") return truth_file_kind;
  const std::string small = lower(name);
  for (const Mark& ending : endings) {
    if (small.ends_with(ending.bytes)) return ending.kind;
  }
  return std::nullopt;
}

std::string misplaced_file(std::string_view start, std::string_view name,
                           std::string_view expected) {
  const std::optional<FileKind> kind = kind_of_file(start, name);
  if (!kind) return {};
  std::string sentence = "is ";
  sentence.append(kind->what).append(", but ").append(expected);
  return sentence.append(" is expected here; ").append(kind->next);
}

}  // namespace splid
