#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace splid {

// Text from outside (a file, a device, a bridge, a client) as people are shown it, by a terminal,
// the journal or a page. UTF-8 stays; ? stands in the place of each control character, line feeds
// included, of each character that turns the direction of writing, and of each byte that is not
// UTF-8. Text of more than `most` bytes is cut, and "..." follows.
//
// Threads: any. Errors: none.
std::string shown_text(std::string_view text, std::size_t most);

// The same for a report of several lines: its line feeds stay, and it is not cut.
std::string shown_lines(std::string_view text);

// The most bytes of a quotation within a sentence, and of a sentence.
inline constexpr std::size_t most_quoted = 120;
inline constexpr std::size_t most_said = 2000;

}  // namespace splid
