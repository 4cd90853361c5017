#pragma once

#include <span>
#include <string>
#include <string_view>

namespace splid {

// Of `names` the one with the fewest letters to change, insert, leave out or swap to make `name`;
// the first of equals. Null where none is near: more than half of its letters would change.
const char* nearest_name(std::string_view name, std::span<const char* const> names);

// "; did you mean NAME?", or the list of all where none is near, or nothing where there are none.
std::string suggest_name(std::string_view name, std::span<const char* const> names);

}  // namespace splid
