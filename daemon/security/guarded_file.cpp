#include "daemon/security/guarded_file.hpp"

#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <system_error>
#include <utility>

#include "config/hidden_keys.hpp"
#include "config/read_file.hpp"
#include "protocol/error.hpp"

namespace splid::security {
namespace {

constexpr mode_t writable_by_others = S_IWGRP | S_IWOTH;
constexpr mode_t open_to_others = S_IRWXG | S_IRWXO;

constexpr std::size_t most_key_bytes = 1 << 20;  // enough for thousands of keys

[[noreturn]] void refuse(const std::string& place, const std::string& what) {
  throw Error(Fault::usage, hide_keys(place + ": " + what));
}

[[noreturn]] void refuse_by_errno(const std::string& file) {
  refuse(file, "cannot be read: " + std::generic_category().message(errno));
}

// Opens the file, and calls `use` with it. Errors about the file hide keys, since a person may
// have given a key in the place of a file.
template <class Use>
std::string with_file(const std::string& name, const Use& use) {
  try {
    return use(RegularFile(name));
  } catch (const Error& error) {
    throw Error(error.fault(), hide_keys(error.what()));
  }
}

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
  return with_file(file, [&](const RegularFile& open) {
    check_unforgeable(file, open.facts());
    return open.read(most_key_bytes);
  });
}

std::string read_secret_file(const std::string& file) {
  return with_file(file, [&](const RegularFile& open) {
    if (is_credential(file)) return open.read(most_key_bytes);
    if ((open.facts().st_mode & open_to_others) != 0) {
      refuse(file, "is a secret that others than its owner may use (mode " +
                       octal(open.facts().st_mode) + "); chmod 600 " + file +
                       ", and make a new key if somebody may have read it");
    }
    check_unforgeable(file, open.facts());
    return open.read(most_key_bytes);
  });
}

std::string read_public_file(const std::string& file) {
  return with_file(file, [](const RegularFile& open) { return open.read(most_key_bytes); });
}

}  // namespace splid::security
