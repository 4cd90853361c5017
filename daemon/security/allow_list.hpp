#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace splid::security {

// The public keys that may connect, each with the name of its owner.
//
// As a file: one line "KEY name" for each key. KEY is in Z85; the name is the rest of the line, 1
// to 64 printable ASCII characters. Empty lines and lines that begin with # are passed over. No key
// begins with #, since five Z85 characters that begin with # would stand for more than 32 bits.
class AllowList {
 public:
  AllowList() = default;  // an empty list, which lets nobody in

  // file: the name for errors. Errors: Error(Fault::usage) with the file, the line and what to do,
  // for a line of any other form and for a key that is listed twice.
  static AllowList parse(std::string_view text, const std::string& file);
  // Errors: as parse(); Error(Fault::usage) also where the file cannot be read, and where somebody
  // other than its owner could have written it (guarded_file.hpp).
  static AllowList read(const std::string& file);

  // The name of the key's owner; absent where the key is not listed and so may not connect.
  [[nodiscard]] std::optional<std::string> name_of(std::string_view public_key) const;
  [[nodiscard]] std::size_t size() const { return names_.size(); }
  // How many keys of this list are not in `other`.
  [[nodiscard]] std::size_t missing_in(const AllowList& other) const;

 private:
  std::map<std::string, std::string, std::less<>> names_;  // by public key
};

}  // namespace splid::security
