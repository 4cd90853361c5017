#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace splid::test {

// The text of a page from a heading, such as "## status", to the next heading of any level; empty
// where the page has no such heading.
inline std::string manual_section(const std::string& page, const std::string& heading) {
  const std::size_t begin = page.find("\n" + heading + "\n");
  if (begin == std::string::npos) return "";
  const std::size_t end = page.find("\n#", begin + 1 + heading.size());
  return page.substr(begin, end - begin);
}

// What stands between backticks in a text, in its order.
inline std::vector<std::string> manual_names(std::string_view text) {
  std::vector<std::string> names;
  for (std::size_t at = 0; (at = text.find('`', at)) != std::string_view::npos;) {
    const std::size_t end = text.find('`', at + 1);
    if (end == std::string_view::npos) break;
    names.emplace_back(text.substr(at + 1, end - at - 1));
    at = end + 1;
  }
  return names;
}

// The members that the table of a section explains: the names in the first cell of each row.
inline std::vector<std::string> manual_members(const std::string& page,
                                               const std::string& heading) {
  std::vector<std::string> members;
  const std::string section = manual_section(page, heading);
  for (std::size_t row = 0; (row = section.find("\n| `", row)) != std::string::npos; ++row) {
    const std::size_t cell = row + 2;
    const auto names = manual_names(section.substr(cell, section.find(" | ", cell) - cell));
    members.insert(members.end(), names.begin(), names.end());
  }
  return members;
}

}  // namespace splid::test
