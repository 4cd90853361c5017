#include "daemon/recording/recording_folder.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/recording/encoder_log.hpp"
#include "daemon/recording/table_head.hpp"
#include "protocol/error.hpp"

namespace splid::recording {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view shape = "splid-########T######Z-";
constexpr std::string_view ending = ".ptu";
constexpr std::size_t least_digits = 6;

struct Kept {
  std::uint64_t number = 0;
  std::string path;
  std::uint64_t bytes = 0;  // of the recording and the files beside it
};

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// The number in a recording's name; absent where file_name() does not make such names.
std::optional<std::uint64_t> number_of(std::string_view name) {
  if (name.size() < shape.size() + least_digits + ending.size()) return std::nullopt;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    if (shape[i] == '#' ? !is_digit(name[i]) : name[i] != shape[i]) return std::nullopt;
  }
  if (!name.ends_with(ending)) return std::nullopt;
  name.remove_prefix(shape.size());
  name.remove_suffix(ending.size());
  std::uint64_t number = 0;
  const auto [stop, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (error != std::errc{} || stop != name.data() + name.size()) return std::nullopt;
  return number;
}

std::string file_name(double unix_s, std::uint64_t number) {
  const auto seconds = static_cast<std::time_t>(std::floor(unix_s));
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  return fmt::format("splid-{:04}{:02}{:02}T{:02}{:02}{:02}Z-{:06}.ptu", utc.tm_year + 1900,
                     utc.tm_mon + 1, utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec, number);
}

std::uint64_t size_of(const std::string& path) {
  std::error_code absent;
  const std::uintmax_t bytes = fs::file_size(path, absent);
  return absent ? 0 : bytes;
}

// The recording, its encoder counts and the tables of its frames, whether they are there or not.
std::vector<std::string> files_of(const std::string& recording) {
  std::vector<std::string> files = {recording, encoder_file_of(recording)};
  for (std::string& table : table_files_beside(recording)) files.push_back(std::move(table));
  return files;
}

// Sorted from the oldest to the newest: by number and not by name, since the host's UTC may have
// been set back.
std::vector<Kept> recordings_in(const std::string& folder) {
  std::vector<Kept> kept;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const auto number = number_of(entry.path().filename().string());
    if (!number || !entry.is_regular_file()) continue;
    const std::string path = entry.path().string();
    kept.push_back({*number, path, 0});
    for (const std::string& file : files_of(path)) kept.back().bytes += size_of(file);
  }
  std::sort(kept.begin(), kept.end(),
            [](const Kept& a, const Kept& b) { return a.number < b.number; });
  return kept;
}

}  // namespace

Folder::~Folder() {
  if (lock_ != -1) ::close(lock_);
}

// The kernel releases the lock when the process ends, however it ends. A file system that has no
// such locks is used without a lock.
// Where the folder was removed and made anew, the new folder is locked.
void Folder::lock() {
  struct stat locked {};
  struct stat present {};
  if (lock_ != -1 && ::fstat(lock_, &locked) == 0 && ::stat(path_.c_str(), &present) == 0 &&
      locked.st_dev == present.st_dev && locked.st_ino == present.st_ino) {
    return;
  }
  if (lock_ != -1) ::close(lock_);
  lock_ = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock_ == -1 || ::flock(lock_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  ::close(std::exchange(lock_, -1));
  throw Error(Fault::device, path_ +
                                 ": another splid records into it; give record.folder a folder of "
                                 "its own");
}

std::string Folder::next(double unix_s, std::uint64_t file_bytes) {
  try {
    fs::create_directories(path_);
    lock();
    const std::vector<Kept> kept = recordings_in(path_);
    std::uint64_t bytes = file_bytes;
    for (const Kept& file : kept) bytes += file.bytes;
    for (const Kept& file : kept) {
      if (bytes <= max_bytes_) break;
      for (const std::string& path : files_of(file.path)) fs::remove(path);
      bytes -= file.bytes;
    }
    if (!kept.empty()) number_ = std::max(number_, kept.back().number);
    return path_ + "/" + file_name(unix_s, ++number_);
  } catch (const fs::filesystem_error& error) {
    throw Error(Fault::device, error.path1().string() + ": " + error.code().message() +
                                   "; record.folder must be a folder that splid may write to");
  }
}

std::uint64_t Folder::free_bytes() const {
  std::error_code absent;
  const fs::space_info space = fs::space(path_, absent);
  // Where the folder cannot be looked at, making a file in it will say what is wrong.
  return absent ? UINT64_MAX : space.available;
}

}  // namespace splid::recording
