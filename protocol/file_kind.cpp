#include "protocol/file_kind.hpp"

#include <algorithm>
#include <array>
#include <cctype>

#include "protocol/recording_format.hpp"

namespace splid {
namespace {

using namespace std::string_view_literals;

struct Mark {
  std::string_view start;   // the file's first bytes; empty: any
  std::string_view ending;  // the end of its name, in small letters; empty: any
  FileKind kind;
};

constexpr std::string_view t3_next =
    "record again in T2 mode, as PTU, or in T3 mode as PTU, if that must be: it lacks the syncs' "
    "own times, which are the pattern's clock, and no program brings them back";
constexpr std::string_view counts_next =
    "record again in T2 mode, as PTU: no program brings single photons back";
constexpr std::string_view sdt_next =
    "it holds curves and no photons: record again in the FIFO mode, as .spc, with the settings "
    "(.set) saved beside it";
constexpr std::string_view set_next =
    "name the recording beside it (.spc), which splid reads together with it";
constexpr std::string_view swabian_next =
    "have the FileReader of Swabian's Python module TimeTagger write its times as text, and make a "
    "PTU of that (docs/guide/recording.md, \"Recordings of other kinds\")";
constexpr std::string_view hdf5_next =
    "splid check says whether it is Photon-HDF5, and splid convert then makes a PTU of it";

constexpr std::string_view text_next =
    "a list of times can become a recording (docs/guide/recording.md, \"Files that splid cannot "
    "read\")";
constexpr std::string_view itself_next = "name the recording itself";

constexpr FileKind histogram_kind = {
    "a PicoQuant histogram (PHU), which holds counts and no photons", counts_next};

constexpr FileKind no_hdf5_kind = {
    "an HDF5 file by its name alone, without the mark that HDF5 begins with",
    "copy it again from where it was made, or give it the name of what it is"};

// The first kind that fits is taken. A JSON file's schema goes before kinds that only a name tells.
constexpr std::array marks = {
    Mark{"PQHISTO"sv, "", histogram_kind},
    Mark{"TimeHarp"sv, "", {"a PicoQuant file of the kind before PTU (.t3r, .thd)", t3_next}},
    Mark{"\x89HDF\r\n\x1a\n"sv,
         "",
         {"an HDF5 file: a table of frames, Photon-HDF5 or something else", hdf5_next}},
    Mark{"\x1f\x8b"sv, "", {"a gzip archive", "unpack it first, with gunzip"}},
    Mark{"\xfd"
         "7zXZ\0"sv,
         "",
         {"an xz archive", "unpack it first, with unxz"}},
    Mark{"\x28\xb5\x2f\xfd"sv, "", {"a zstd archive", "unpack it first, with unzstd"}},
    Mark{"BZh"sv, "", {"a bzip2 archive", "unpack it first, with bunzip2"}},
    Mark{"PK\x03\x04"sv, "", {"a ZIP archive", "unpack it first, with unzip"}},
    Mark{"\xff\xd8\xff"sv, "", {"a picture (JPEG)", itself_next}},
    Mark{"\x89PNG\r\n"sv, "", {"a picture (PNG)", itself_next}},
    Mark{"%PDF"sv, "", {"a document (PDF)", itself_next}},
};

// Formats that do not begin with a mark that could be relied on.
constexpr std::array endings = {
    Mark{"", ".ttbin"sv, {"a Swabian Time Tagger file by its name", swabian_next}},
    Mark{"", ".t3r"sv, {"a TimeHarp recording in T3 mode by its name", t3_next}},
    Mark{"", ".ts"sv, {"an S-Fifteen file of time stamps by its name", text_next}},
    Mark{"", ".sdt"sv, {"a Becker & Hickl file of measured curves by its name", sdt_next}},
    Mark{"", ".set"sv, {"the settings of a Becker & Hickl module by its name", set_next}},
    Mark{"", ".phu"sv, {"a PicoQuant histogram by its name", counts_next}},
    Mark{"", ".h5"sv, no_hdf5_kind},
    Mark{"", ".hdf5"sv, no_hdf5_kind},
};

std::string_view skip(std::string_view text, std::string_view what) {
  const std::size_t first = text.find_first_not_of(what);
  return first == std::string_view::npos ? std::string_view{} : text.substr(first);
}

// The value of "schema", found as text: a file with a mistake in its JSON still has its kind.
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
  const std::string small = lower(name);
  const auto fits = [&](const Mark& mark) {
    return start.starts_with(mark.start) && small.ends_with(mark.ending);
  };
  if (const auto format = format_of(start, name))
    return FileKind{in_words(*format), recording_next};
  const auto* const mark = std::find_if(marks.begin(), marks.end(), fits);
  if (mark != marks.end()) return mark->kind;
  const std::string_view schema = schema_of(start);
  if (schema == "splid.config") return config_file_kind;
  if (schema == "splid.pattern") return pattern_file_kind;
  if (schema == "splid.truth") return truth_file_kind;
  const auto* const ending = std::find_if(endings.begin(), endings.end(), fits);
  return ending == endings.end() ? std::nullopt : std::optional(ending->kind);
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
