#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/tag.hpp"

namespace splid {

// How losses stand in a recording's header (tag Splid_Losses): begin:end:count in ps of the
// tagger's clock, apart by spaces, such as "1000:2500:3 9000:9000:1 12000:15000:-1". Plain decimal
// digits, since the numbers pass 2^53, where readers of JSON lose digits.

// Fits into max_chars (at least 64): neighbours are joined, those with the smallest gaps first,
// until it does. Losses sorted by begin.
std::string losses_to_text(std::vector<Loss> losses, std::size_t max_chars);

// Null where the text is no such list, or an end lies before its begin.
std::optional<std::vector<Loss>> losses_from_text(std::string_view text);

}  // namespace splid
