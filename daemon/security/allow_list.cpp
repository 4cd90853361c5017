#include "daemon/security/allow_list.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "daemon/security/curve_key.hpp"
#include "daemon/security/guarded_file.hpp"
#include "protocol/error.hpp"
#include "protocol/text.hpp"

namespace splid::security {
namespace {

constexpr std::size_t max_name_characters = 64;

struct Entry {
  std::string_view key;
  std::string_view name;
};

bool is_name(std::string_view name) {
  return !name.empty() && name.size() <= max_name_characters &&
         std::all_of(name.begin(), name.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

Entry split(std::string_view line) {
  const std::size_t end = std::min(line.find_first_of(blanks), line.size());
  return {line.substr(0, end), trimmed(line.substr(end))};
}

// What is wrong with a line; null where nothing is.
const char* fault_of(const Entry& entry) {
  if (!is_curve_key(entry.key)) {
    return "does not begin with a public key, 40 characters of Z85; write KEY name, or # before a "
           "comment";
  }
  if (!is_name(entry.name)) {
    return "has no name of 1 to 64 printable ASCII characters behind the key, which tells whose it "
           "is; write KEY name";
  }
  return nullptr;
}

}  // namespace

AllowList AllowList::parse(std::string_view text, const std::string& file) {
  AllowList list;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty() || line.starts_with('#')) continue;
    const Entry entry = split(line);
    const auto refuse = [&](const std::string& what) {
      throw Error(Fault::usage, fmt::format("{}:{}: {}", file, number, what));
    };
    if (const char* fault = fault_of(entry)) refuse(fault);
    const auto [place, is_new] = list.names_.emplace(entry.key, entry.name);
    if (!is_new) refuse("has the key of " + place->second + " again; remove one of the lines");
  }
  return list;
}

AllowList AllowList::read(const std::string& file) {
  return parse(read_unforgeable_file(file), file);
}

std::optional<std::string> AllowList::name_of(std::string_view public_key) const {
  const auto found = names_.find(public_key);
  if (found == names_.end()) return std::nullopt;
  return found->second;
}

std::size_t AllowList::missing_in(const AllowList& other) const {
  return static_cast<std::size_t>(std::count_if(names_.begin(), names_.end(), [&](const auto& own) {
    return !other.names_.contains(own.first);
  }));
}

}  // namespace splid::security
