#include "daemon/batch/batch_folder.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "daemon/base/sha256.hpp"
#include "daemon/base/write_file.hpp"
#include "protocol/error.hpp"
#include "protocol/frame_columns.hpp"
#include "protocol/json_value.hpp"
#include "protocol/json_writer.hpp"

namespace splid::batch {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* manifest_name = "batch.json";
constexpr const char* slice_ending = ".slice";
constexpr std::size_t identifying_bytes = 64 << 10;

// The text of a file; absent where it cannot be read.
std::optional<std::string> text_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return std::nullopt;
  std::string text{std::istreambuf_iterator<char>(in), {}};
  return in.bad() ? std::nullopt : std::optional(std::move(text));
}

std::string place_of_manifest(const std::string& folder) { return folder + "/" + manifest_name; }

// What the frames are measured by, as one line that two batches compare.
std::string facts_line(const Facts& facts) {
  JsonWriter line;
  line.text("program", facts.program).integer("slice_frames", facts.slice_frames);
  line.raw("configuration", facts.config_json).raw("pattern", facts.pattern_json);
  return line.finish();
}

void make_folder(const std::string& folder) {
  std::error_code failure;
  fs::create_directories(folder, failure);
  if (failure) throw Error(Fault::device, folder + ": cannot be made: " + failure.message());
}

// Null where there is none.
json read_manifest(const std::string& folder) {
  const auto text = text_of(place_of_manifest(folder));
  if (!text) return nullptr;
  json manifest = json_value_if_any(*text);
  const bool is_one = manifest.is_object() && manifest.contains("measured_by") &&
                      manifest.contains("recordings") && manifest["recordings"].is_array();
  if (is_one) return manifest;
  throw Error(Fault::usage, place_of_manifest(folder) +
                                ": is not the list of a batch; give another folder with --output");
}

// Files whose name begins with batch.json may be those of a shard that begins at the same time.
void check_is_empty(const std::string& folder) {
  std::error_code failure;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, failure)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(manifest_name)) continue;
    if (!read_manifest(folder).is_null()) return;
    throw Error(Fault::usage,
                fmt::format("--output {}: has other things in it, such as {}, and no {}; give a "
                            "folder that is new, empty, or of an earlier batch",
                            folder, name, manifest_name));
  }
}

// What is different, for a person.
std::string difference(const json& before, const json& now) {
  if (before.value("program", "") != now.value("program", "")) {
    return "by " + before.value("program", "another program") + " and not by " +
           now.value("program", "");
  }
  for (const json& step : json::diff(before, now)) {
    const std::string path = step.value("path", "");
    if (path.starts_with("/configuration")) {
      return "with another configuration, which differs at " + path.substr(14);
    }
  }
  return "with another pattern";
}

void check_same(const std::string& folder, const json& before, const std::string& now) {
  if (json_text(before) == json_text(json_value(now))) return;
  throw Error(Fault::usage, "--output " + folder + ": its frames were measured " +
                                difference(before, json_value(now)) +
                                "; give another folder, or remove this one");
}

// The first line of a slice; absent where it has another key or the rows behind it are not whole.
std::optional<SliceHead> read_slice_head(const std::string& file, const std::string& key) {
  std::ifstream in(file, std::ios::binary);
  std::string line;
  if (!std::getline(in, line)) return std::nullopt;
  const json head = json_value_if_any(line);
  if (!head.is_object() || head.value("key", "") != key) return std::nullopt;
  const SliceHead found{head.value("slice", std::uint64_t{0}),
                        head.value("frames", std::uint64_t{0}),
                        head.value("rows", std::uint64_t{0})};
  std::error_code unknown;
  const std::uintmax_t bytes = fs::file_size(file, unknown);
  if (unknown || bytes != line.size() + 1 + found.rows * frame_row_bytes()) return std::nullopt;
  return found;
}

}  // namespace

void Folder::begin(const Facts& facts, const std::vector<Recording>& recordings) const {
  make_folder(folder_);
  check_is_empty(folder_);
  const json before = read_manifest(folder_);
  const std::string measured_by = facts_line(facts);
  json list = json::array();
  if (!before.is_null()) {
    check_same(folder_, before["measured_by"], measured_by);
    list = before["recordings"];
  }
  const std::size_t known = list.size();
  for (const Recording& recording : recordings) {
    const json entry = {{"name", recording.name}, {"file", recording.file}};
    if (std::find(list.begin(), list.end(), entry) == list.end()) list.push_back(entry);
  }
  if (!before.is_null() && list.size() == known) return;
  JsonWriter manifest;
  manifest.text("schema", "splid.batch").raw("v", "[1,0]");
  manifest.raw("measured_by", measured_by);
  manifest.raw("recordings", json_text(list));
  write_file(place_of_manifest(folder_), manifest.finish() + "\n");
}

std::vector<Recording> Folder::recordings() const {
  const json manifest = read_manifest(folder_);
  if (manifest.is_null()) {
    throw Error(Fault::usage, folder_ + ": there is no " + manifest_name +
                                  "; name the folder that splid batch --output was given");
  }
  std::vector<Recording> found;
  for (const json& entry : manifest["recordings"]) {
    Recording recording;
    recording.file = entry.value("file", "");
    recording.name = entry.value("name", "");
    found.push_back(std::move(recording));
  }
  return found;
}

std::string Folder::key_of(const Facts& facts, const Recording& recording) {
  std::string start(identifying_bytes, '\0');
  errno = 0;
  std::ifstream in(recording.file, std::ios::binary);
  in.read(start.data(), static_cast<std::streamsize>(start.size()));
  if (!in.is_open() || in.bad() || (in.fail() && !in.eof())) {
    throw Error(Fault::data, recording.file + ": cannot open the recording: " +
                                 std::strerror(errno != 0 ? errno : EIO) + "; check its path");
  }
  start.resize(static_cast<std::size_t>(in.gcount()));
  return sha256_of(facts_line(facts) + fmt::format("\n{}\n", recording.bytes) + start);
}

std::optional<Folder::Members> Folder::read(const Recording& recording, const std::string& file,
                                            const std::string& key) const {
  const auto text = text_of(folder_of(recording) + "/" + file);
  if (!text) return std::nullopt;
  const json found = json_value_if_any(*text);
  if (!found.is_object()) return std::nullopt;
  Members members;
  for (const auto& [name, value] : found.items()) {
    if (value.is_string()) members[name] = value.get<std::string>();
  }
  if (!key.empty() && members["key"] != key) return std::nullopt;
  return members;
}

void Folder::write(const Recording& recording, const std::string& file,
                   const Members& members) const {
  make_folder(folder_of(recording));
  JsonWriter json;
  for (const auto& [name, value] : members) json.text(name, value);
  write_file(folder_of(recording) + "/" + file, json.finish() + "\n");
}

std::optional<std::string> Folder::finished(const Recording& recording,
                                            const std::string& key) const {
  const auto summary = read(recording, summary_of_recording, key);
  std::error_code absent;
  if (!summary || !summary->contains("lines")) return std::nullopt;
  if (!fs::is_regular_file(table_file(recording), absent)) return std::nullopt;
  return summary->at("lines");
}

std::string Folder::slice_file(const Recording& recording, std::uint64_t number) const {
  return folder_of(recording) + fmt::format("/{:06}", number) + slice_ending;
}

std::vector<SliceHead> Folder::slices(const Recording& recording, const std::string& key) const {
  std::vector<SliceHead> found;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder_of(recording), none)) {
    if (entry.path().extension() != slice_ending) continue;
    const auto head = read_slice_head(entry.path().string(), key);
    if (head) found.push_back(*head);
  }
  std::sort(found.begin(), found.end(),
            [](const SliceHead& a, const SliceHead& b) { return a.number < b.number; });
  return found;
}

std::string Folder::slice_rows(const Recording& recording, const SliceHead& slice) const {
  const std::string file = slice_file(recording, slice.number);
  const std::string text = text_of(file).value_or("");
  const std::size_t line = text.find('\n');
  const std::uint64_t bytes = slice.rows * frame_row_bytes();
  if (line == std::string::npos || text.size() - line - 1 != bytes) {
    throw Error(Fault::device, file + ": cannot be read any more; run splid batch again");
  }
  return text.substr(line + 1);
}

void Folder::write_slice(const Recording& recording, const std::string& key, const SliceHead& slice,
                         const std::string& rows) const {
  make_folder(folder_of(recording));
  JsonWriter head;
  head.text("schema", "splid.slice").raw("v", "[1,0]").text("key", key);
  head.integer("slice", slice.number).integer("frames", slice.frames);
  head.integer("rows", rows.size() / frame_row_bytes());
  write_file(slice_file(recording, slice.number), head.finish() + "\n" + rows);
}

std::string Folder::table_file(const Recording& recording) const {
  return folder_ + "/" + recording.name + ".h5";
}

std::string Folder::new_table_file(const Recording& recording) const {
  return folder_of(recording) + "/table.h5";
}

void Folder::keep_table(const Recording& recording) const {
  const std::string file = table_file(recording);
  make_folder(fs::path(file).parent_path().string());
  std::error_code failure;
  fs::rename(new_table_file(recording), file, failure);
  if (failure) throw Error(Fault::device, file + ": cannot be made: " + failure.message());
}

void Folder::remove_slices(const Recording& recording) const {
  std::error_code failure;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder_of(recording), failure)) {
    // A recording's folder may hold those of others, whose names begin with its own.
    if (entry.is_regular_file(failure) && entry.path().filename() != summary_of_recording) {
      files.push_back(entry.path());
    }
  }
  for (const fs::path& file : files) fs::remove(file, failure);
}

}  // namespace splid::batch
