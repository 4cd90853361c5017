#pragma once

#include <string_view>

namespace splid {

inline constexpr std::string_view blanks = " \t\r\n";

// The text without such characters at its ends.
inline std::string_view trimmed(std::string_view text, std::string_view characters = blanks) {
  const std::size_t begin = text.find_first_not_of(characters);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(characters) + 1 - begin);
}

}  // namespace splid
