#include "daemon/security/guarded_file.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <system_error>
#include <utility>

#include "config/hidden_keys.hpp"
#include "protocol/error.hpp"

namespace splid::security {
namespace {

constexpr mode_t writable_by_others = S_IWGRP | S_IWOTH;
constexpr mode_t open_to_others = S_IRWXG | S_IRWXO;

// Enough for thousands of keys; a larger file is a disk or a device named by mistake, and is
// refused.
constexpr std::size_t max_bytes = 1 << 20;

[[noreturn]] void refuse(const std::string& place, const std::string& what) {
  throw Error(Fault::usage, hide_keys(place + ": " + what));
}

[[noreturn]] void refuse_by_errno(const std::string& file) {
  refuse(file, "cannot be read: " + std::generic_category().message(errno));
}

// An open file: its owner and mode are those of the bytes that are read, even if another file gets
// its name meanwhile.
class OpenFile {
 public:
  explicit OpenFile(std::string name)
      : name_(std::move(name)),
        // O_NONBLOCK: does not wait for the other end of a pipe.
        file_(::open(name_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
    if (file_ < 0) refuse_by_errno(name_);
    if (::fstat(file_, &facts_) != 0) refuse_by_errno(name_);
    if (!S_ISREG(facts_.st_mode)) refuse(name_, "is no file; name the file itself");
  }
  ~OpenFile() { ::close(file_); }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  [[nodiscard]] const struct stat& facts() const { return facts_; }

  [[nodiscard]] std::string read() const {
    std::string text;
    std::array<char, 4096> some{};
    for (ssize_t got = 0; (got = ::read(file_, some.data(), some.size())) != 0;) {
      if (got < 0) refuse_by_errno(name_);
      text.append(some.data(), static_cast<std::size_t>(got));
      if (text.size() > max_bytes) refuse(name_, "has more than 1 MiB; is this a file of keys?");
    }
    return text;
  }

 private:
  std::string name_;
  int file_;
  struct stat facts_ {};
};

bool is_ours(const struct stat& facts) { return facts.st_uid == ::geteuid() || facts.st_uid == 0; }

std::string octal(mode_t mode) { return fmt::format("{:04o}", mode & 07777U); }

void check_owner(const std::string& place, const struct stat& facts) {
  if (is_ours(facts)) return;
  refuse(place,
         fmt::format("belongs to user {}, who could put another key there; chown it to root or "
                     "to user {}, who runs splid",
                     facts.st_uid, ::geteuid()));
}

struct stat facts_of(const std::string& place) {
  struct stat facts {};
  if (::lstat(place.c_str(), &facts) != 0) refuse_by_errno(place);
  return facts;
}

// Checks the owner and the mode of a folder on the way to `file`.
void check_folder(const std::string& folder, const std::string& file) {
  const struct stat facts = facts_of(folder);
  check_owner(folder, facts);
  const bool sticky = (facts.st_mode & S_ISVTX) != 0;
  if ((facts.st_mode & writable_by_others) == 0 || sticky) return;
  refuse(folder, "lets others put another file in the place of " + file + " (mode " +
                     octal(facts.st_mode) + "); chmod go-w " + folder);
}

// Walks from the root to the file as the kernel does, and checks each folder and link on the way:
// whoever may write to a folder on the way decides which file is found there, however well the file
// itself is guarded.
class Way {
 public:
  explicit Way(const std::string& file) : file_(file) {
    put_ahead(std::filesystem::absolute(file));
  }

  void check() {
    while (!ahead_.empty()) {
      check_folder(at_.string(), file_);
      const std::filesystem::path next = std::move(ahead_.front());
      ahead_.pop_front();
      step(next);
    }
  }

 private:
  void put_ahead(const std::filesystem::path& path) {
    const std::filesystem::path names = path.relative_path();
    ahead_.insert(ahead_.begin(), names.begin(), names.end());
  }

  void step(const std::filesystem::path& name) {
    if (name.empty() || name == ".") return;
    if (name == "..") {
      at_ = at_.parent_path();
      return;
    }
    const std::filesystem::path next = at_ / name;
    const struct stat facts = facts_of(next.string());
    if (!S_ISLNK(facts.st_mode)) {
      at_ = next;
      return;
    }
    check_owner(next.string(), facts);
    if (++links_ > most_links) refuse(file_, "goes round in links");
    const std::filesystem::path target = std::filesystem::read_symlink(next);
    if (target.is_absolute()) at_ = "/";
    put_ahead(target);
  }

  static constexpr int most_links = 40;  // the kernel's limit
  std::string file_;
  std::filesystem::path at_ = "/";           // the folder reached so far, links resolved
  std::deque<std::filesystem::path> ahead_;  // the names that are left of the path
  int links_ = 0;
};

void check_unforgeable(const std::string& file, const struct stat& facts) {
  check_owner(file, facts);
  if ((facts.st_mode & writable_by_others) != 0) {
    refuse(file, "may be written by others than its owner (mode " + octal(facts.st_mode) +
                     "); chmod go-w " + file);
  }
  Way(file).check();
}

bool is_credential(const std::string& file) {
  const char* folder = std::getenv("CREDENTIALS_DIRECTORY");
  if (folder == nullptr || *folder == '\0') return false;
  std::error_code ignored;
  const auto parent = std::filesystem::path(file).parent_path();
  return std::filesystem::equivalent(parent, folder, ignored);
}

}  // namespace

std::string read_unforgeable_file(const std::string& file) {
  const OpenFile open(file);
  check_unforgeable(file, open.facts());
  return open.read();
}

std::string read_secret_file(const std::string& file) {
  const OpenFile open(file);
  if (is_credential(file)) return open.read();
  if ((open.facts().st_mode & open_to_others) != 0) {
    refuse(file, "is a secret that others than its owner may use (mode " +
                     octal(open.facts().st_mode) + "); chmod 600 " + file +
                     ", and make a new key if somebody may have read it");
  }
  check_unforgeable(file, open.facts());
  return open.read();
}

}  // namespace splid::security
