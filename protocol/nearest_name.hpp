#pragma once

#include <span>
#include <string>
#include <string_view>

namespace splid {

// The name in `names` that takes the fewest letters to change, insert, leave out or swap to become
// `name`; of equally near names the first. Null where no name is near: more than two of five
// letters would have to change.
const char* nearest_name(std::string_view name, std::span<const char* const> names);

// "; did you mean NAME?" for the nearest name, or the list of all names where none is near. Empty
// where there are no names.
std::string suggest_name(std::string_view name, std::span<const char* const> names);

}  // namespace splid
