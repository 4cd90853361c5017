#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/tag.hpp"

namespace splid {

// The text of losses in a recording's header (tag Splid_Losses): begin:end:count in ps of the
// tagger's clock, with spaces between, such as "1000:2500:3 9000:9000:1 12000:15000:-1". It is no
// JSON, since the numbers pass 2^53, where readers of JSON lose digits.

// Writes the losses, which are sorted by begin. Neighbours are joined, those with the smallest gaps
// first, until the text fits into max_chars (at least 64).
std::string losses_to_text(std::vector<Loss> losses, std::size_t max_chars);

// Reads such a text. Absent where it is no such list, or an end lies before its begin.
std::optional<std::vector<Loss>> losses_from_text(std::string_view text);

}  // namespace splid
