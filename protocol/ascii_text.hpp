#pragma once

#include <algorithm>
#include <string>

namespace splid {

// The text with ? in the place of each byte that is no printable ASCII character. A sentence that
// quotes bytes of a file is shown by a terminal and by systemd's journal then: the journal shows a
// line with other bytes as "blob data".
inline std::string ascii_text(std::string text) {
  const auto is_other = [](char c) { return c < ' ' || c > '~'; };
  std::replace_if(text.begin(), text.end(), is_other, '?');
  return text;
}

}  // namespace splid
