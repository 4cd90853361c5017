#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace splid {

// Who may connect: public keys and what each is called.
//
// As a file: a line each, "KEY name", KEY in Z85, the name what follows, 1 to 64 printable
// characters of ASCII. Empty lines and lines that begin with # are passed over; no key begins with
// it, since five characters from # on stand for more than 32 bits.
class AllowList {
 public:
  AllowList() = default;  // lets nobody in

  // Errors: Error(Fault::usage) with file, line and what to do, for a line that is none of these
  // and for a key that stands there twice.
  static AllowList parse(std::string_view text, const std::string& file);
  // Errors: as well, and where it cannot be read or others than its owner can write it.
  static AllowList read(const std::string& file);

  // Absent: it may not.
  [[nodiscard]] std::optional<std::string> name_of(std::string_view public_key) const;
  [[nodiscard]] std::size_t size() const { return names_.size(); }
  // How many keys of this are not in the other.
  [[nodiscard]] std::size_t missing_in(const AllowList& other) const;

 private:
  std::map<std::string, std::string, std::less<>> names_;  // by public key
};

}  // namespace splid
