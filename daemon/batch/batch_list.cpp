#include "daemon/batch/batch_list.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>

#include "protocol/error.hpp"
#include "protocol/recording_format.hpp"
#include "protocol/text.hpp"

namespace splid::batch {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t most_shards = 100'000;

// The path below `folder` without the ending .ptu, which alone is left out so that a.ptu and a.pt2
// have a name each; that of a file alone is its name.
std::string table_name(const fs::path& file, const fs::path& folder) {
  fs::path name = folder.empty() ? file.filename() : file.lexically_relative(folder);
  if (name.extension() == ".ptu") name.replace_extension();
  return name.generic_string();
}

void list_file(const fs::path& file, const fs::path& folder, std::vector<Recording>& into) {
  std::error_code unknown;
  const std::uintmax_t bytes = fs::file_size(file, unknown);
  Recording recording;
  recording.file = file.string();
  recording.name = table_name(file, folder);
  if (!unknown) recording.bytes = std::max<std::uint64_t>(bytes, 1);
  into.push_back(std::move(recording));
}

// "*.ptu, *.pt2"
std::string listed_endings() {
  std::string text;
  for (const std::string_view ending : recording_endings()) {
    text += text.empty() ? "*" : ", *";
    text += ending;
  }
  return text;
}

void list_folder(const fs::path& folder, std::vector<Recording>& into) {
  std::vector<fs::path> files;
  std::error_code failure;
  for (auto entry = fs::recursive_directory_iterator(folder, failure);
       !failure && entry != fs::recursive_directory_iterator(); entry.increment(failure)) {
    if (is_named_as_recording(entry->path().native()) && !entry->is_directory(failure)) {
      files.push_back(entry->path());
    }
  }
  if (failure) {
    throw Error(Fault::usage, folder.string() + ": cannot be listed: " + failure.message());
  }
  if (files.empty()) {
    throw Error(Fault::usage,
                folder.string() +
                    ": there is no recording in this folder or below it (splid looks for " +
                    listed_endings() +
                    "); "
                    "name the recordings, or another folder");
  }
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) list_file(file, folder, into);
}

void check_names_differ(const std::vector<Recording>& recordings) {
  std::map<std::string, std::string> file_of;
  for (const Recording& recording : recordings) {
    const auto [place, is_new] = file_of.emplace(recording.name, recording.file);
    if (is_new) continue;
    throw Error(Fault::usage, recording.file + " and " + place->second +
                                  ": both frames would go into " + recording.name +
                                  ".h5; name each recording once, or a folder above both");
  }
}

}  // namespace

std::vector<Recording> find_recordings(const std::vector<std::string>& given) {
  std::vector<Recording> recordings;
  for (const std::string& path : given) {
    std::error_code absent;
    if (fs::is_directory(path, absent)) {
      list_folder(path, recordings);
    } else {
      list_file(path, {}, recordings);
    }
  }
  check_names_differ(recordings);
  std::uint64_t begin = 0;
  for (Recording& recording : recordings) {
    recording.begin = begin;
    begin += recording.bytes;
  }
  return recordings;
}

Shard shard_of(const std::string& text) {
  const std::size_t slash = text.find('/');
  const auto index = whole_number(text.substr(0, slash));
  const auto count = slash == std::string::npos
                         ? std::nullopt
                         : whole_number(std::string_view(text).substr(slash + 1));
  const bool is_one = index && count && *index >= 1 && *index <= *count && *count <= most_shards;
  if (!is_one) {
    throw Error(Fault::usage, "--shard " + text +
                                  ": must be i/N with i from 1 to N, such as 3/7 for the third of "
                                  "seven shares");
  }
  return {static_cast<std::uint64_t>(*index), static_cast<std::uint64_t>(*count)};
}

Part part_of(const Shard& shard, const Recording& recording, std::uint64_t all_bytes) {
  // Where share `k` of the whole begins; without all_bytes * k, which may not fit 64 bits.
  const auto begin_of = [&](std::uint64_t k) {
    return all_bytes / shard.count * k + all_bytes % shard.count * k / shard.count;
  };
  const auto inside = [&](std::uint64_t at) {
    return std::clamp(at, recording.begin, recording.begin + recording.bytes) - recording.begin;
  };
  return {inside(begin_of(shard.index - 1)), inside(begin_of(shard.index))};
}

std::uint64_t bytes_of(const std::vector<Recording>& recordings) {
  return recordings.empty() ? 0 : recordings.back().begin + recordings.back().bytes;
}

}  // namespace splid::batch
