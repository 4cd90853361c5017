#include "daemon/security/key_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>

#include "config/hidden_keys.hpp"
#include "daemon/base/write_file.hpp"
#include "daemon/security/guarded_file.hpp"
#include "protocol/error.hpp"
#include "protocol/text.hpp"

namespace splid::security {
namespace {

constexpr mode_t for_all = 0644;
constexpr mode_t for_owner = 0600;

// The value in a line `name = "value"`.
std::optional<std::string> value_of(std::string_view text, std::string_view name) {
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    std::string_view line = trimmed(text.substr(0, end));
    text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
    if (!line.starts_with(name)) continue;
    line = trimmed(line.substr(name.size()));
    if (line.starts_with('=')) return std::string(trimmed(line.substr(1), " \t\"'"));
  }
  return std::nullopt;
}

[[noreturn]] void refuse_keys(const std::string& file, const std::string& what) {
  throw Error(Fault::usage, file + ": " + what);
}

std::string key_value(const std::string& text, const std::string& file, const char* name,
                      const char* made_by) {
  const auto key = value_of(text, name);
  if (!key) refuse_keys(file, std::string("has no line ") + name + " = \"...\"; " + made_by);
  if (!is_curve_key(*key)) {
    refuse_keys(file, std::string("its ") + name + " is no key: a key has 40 characters of Z85");
  }
  return *key;
}

std::string public_text(const std::string& name, const std::string& key) {
  return "# Public key of " + name + ": give it to those who let " + name +
         " in or who connect to " + name +
         ".\n"
         "metadata\n    name = \"" +
         name + "\"\ncurve\n    public-key = \"" + key + "\"\n";
}

std::string secret_text(const std::string& name, const CurveKeyPair& keys) {
  return "# Secret key of " + name +
         ": keep it on its machine, readable by its owner alone (mode 0600).\n"
         "metadata\n    name = \"" +
         name + "\"\ncurve\n    public-key = \"" + keys.public_key + "\"\n    secret-key = \"" +
         keys.secret_key + "\"\n";
}

bool is_name(const std::string& name) {
  const auto is_letter_or_digit = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0;
  };
  return !name.empty() && is_letter_or_digit(name.front()) &&
         std::all_of(name.begin(), name.end(), [&](char c) {
           return is_letter_or_digit(c) || c == '.' || c == '-' || c == '_';
         });
}

// A new file, which is removed again unless it is marked as kept.
class NewFile {
 public:
  NewFile(std::string path, mode_t mode, const std::string& text) : path_(std::move(path)) {
    const int how = O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC;
    const int file = ::open(path_.c_str(), how, for_owner);
    if (file < 0 && errno == EEXIST) {
      refuse_keys(path_,
                  "is there already, and a key is never written over; choose another name, or "
                  "move it away");
    }
    if (file < 0) fail();
    made_ = true;
    const bool written = write_all(file, text) && ::fchmod(file, mode) == 0 && ::fsync(file) == 0;
    const int fault = errno;
    ::close(file);
    if (written) return;
    errno = fault;
    remove();
    fail();
  }
  ~NewFile() { remove(); }
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  void keep() { made_ = false; }

 private:
  void remove() {
    if (made_) ::unlink(path_.c_str());
  }
  [[noreturn]] void fail() const {
    throw Error(Fault::device,
                path_ + ": cannot be written: " + std::generic_category().message(errno));
  }

  std::string path_;
  bool made_ = false;
};

}  // namespace

KeyFiles write_key_files(const std::string& folder, const std::string& name,
                         const CurveKeyPair& keys) {
  if (!is_name(name)) {
    throw Error(Fault::usage, "\"" + name +
                                  "\" cannot name a key: use letters, digits, dots, dashes and "
                                  "underscores, the first a letter or a digit");
  }
  const auto path = (std::filesystem::path(folder) / name).lexically_normal().string();
  KeyFiles files{path + ".key", path + ".key_secret"};
  NewFile secret(files.secret_file, for_owner, secret_text(name, keys));
  NewFile open(files.public_file, for_all, public_text(name, keys.public_key));
  secret.keep();
  open.keep();
  return files;
}

CurveKeyPair parse_secret_key(const std::string& text, const std::string& file) {
  CurveKeyPair keys;
  keys.secret_key = key_value(text, file, "secret-key", "name a .key_secret file of splid keys");
  keys.public_key = public_key_of(keys.secret_key);
  const auto said = value_of(text, "public-key");
  if (said && *said != keys.public_key) {
    refuse_keys(file, "its public-key is not that of its secret-key; one of them was edited");
  }
  return keys;
}

std::string parse_public_key(const std::string& text, const std::string& file) {
  return key_value(text, file, "public-key", "name a .key file of splid keys, or give the key");
}

CurveKeyPair read_secret_key(const std::string& file) {
  return parse_secret_key(read_secret_file(file), file);
}

std::string read_public_key(const std::string& text) {
  std::error_code ignored;
  if (!is_curve_key(text) && hide_keys(text) != text && !std::filesystem::exists(text, ignored)) {
    throw Error(
        Fault::usage,
        "the text given looks like a key, but is neither a public key nor a file: a public key "
        "has 40 characters of Z85; quote it, since a shell changes some of them");
  }
  return is_curve_key(text) ? text : parse_public_key(read_public_file(text), text);
}

}  // namespace splid::security
