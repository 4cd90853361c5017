#include "daemon/base/write_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <system_error>

#include "protocol/error.hpp"

namespace splid {

namespace {

namespace fs = std::filesystem;

// Returns the errno of a failure, 0 for success.
int write_text(const std::string& file, const std::string& text) {
  errno = 0;
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (out) return 0;
  return errno != 0 ? errno : EIO;
}

// The place that a finished file can be renamed to, with links followed. Absent where the file has
// to be written directly: a device such as /dev/stdout cannot be replaced by another file, and
// neither can a file in a folder that this process may not write to.
std::optional<fs::path> replaceable(const std::string& file, const fs::file_status& before) {
  std::error_code failure;
  const bool is_there = fs::exists(before);
  // For a file that does not exist yet, `failure` is set too, although nothing has failed.
  if (is_there ? !fs::is_regular_file(before) : fs::is_symlink(file, failure)) return std::nullopt;
  failure.clear();
  fs::path place = is_there ? fs::canonical(file, failure) : fs::path(file);
  const std::string folder = place.parent_path().empty() ? "." : place.parent_path().string();
  if (failure || ::access(folder.c_str(), W_OK) != 0) return std::nullopt;
  return place;
}

// Returns the errno of a failure, 0 for success.
int write_and_replace(const fs::path& place, const std::string& text,
                      const fs::file_status& before) {
  // Programs in several containers may have the same process number.
  std::random_device random;
  const std::string beside = place.string() + "." + std::to_string(random()) + ".part";
  int fault = write_text(beside, text);
  std::error_code failure;
  if (fault == 0 && fs::exists(before)) fs::permissions(beside, before.permissions(), failure);
  if (fault == 0 && std::rename(beside.c_str(), place.c_str()) != 0) fault = errno;
  if (fault != 0) fs::remove(beside, failure);
  return fault;
}

[[noreturn]] void refuse_file(const std::string& file, int fault) {
  throw Error(Fault::device, file + ": cannot be written: " + std::strerror(fault) +
                                 "; name another file; nothing has been begun");
}

}  // namespace

// A disk that is nearly full takes a part at first, and says with the next one that it is full.
bool write_all(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(file, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

// Design note: the text is written into another file beside `file`, which is then renamed to
// `file`. So a full disk or a kill leaves the old file unchanged.
void write_file(const std::string& file, const std::string& text) {
  std::error_code failure;
  const fs::file_status before = fs::status(file, failure);
  const std::optional<fs::path> place = replaceable(file, before);
  const int fault = place ? write_and_replace(*place, text, before) : write_text(file, text);
  if (fault == 0) return;
  const bool is_kept = place && fs::exists(before);
  throw Error(Fault::device, file + ": cannot be written: " + std::strerror(fault) +
                                 (is_kept ? "; it stays as it was" : ""));
}

void check_may_write(const std::string& file, bool force) {
  check_folder_of(file);
  std::error_code failure;
  const fs::file_status there = fs::status(file, failure);
  if (!fs::status_known(there)) refuse_file(file, failure.value());
  const bool exists = fs::exists(there);
  if (fs::is_directory(there)) throw Error(Fault::usage, file + ": is a folder; name a file");
  if (exists && !force) throw Error(Fault::usage, file + ": exists; --force overwrites it");
  const fs::path folder = fs::path(file).parent_path();
  const std::string place = exists ? file : folder.empty() ? "." : folder.string();
  if (::access(place.c_str(), W_OK) != 0) refuse_file(file, errno);
}

void check_folder_of(const std::string& file) {
  const fs::path folder = fs::path(file).parent_path();
  std::error_code failure;
  const fs::file_status there = fs::status(folder, failure);
  if (folder.empty() || fs::is_directory(there)) return;
  if (!fs::status_known(there)) refuse_file(file, failure.value());
  throw Error(Fault::device, file + ": there is no folder " + folder.string() +
                                 "; make it, or name a file in another");
}

}  // namespace splid
