#pragma once

#include <string>
#include <vector>

// What regular expressions find. Tests that look for text call these, so that the standard
// library's compiler of expressions is itself compiled once: each further file takes a second
// longer.

namespace splid::test {

// The first match and its groups; empty where there is none. pattern: as ECMAScript has it.
std::vector<std::string> first_match(const std::string& text, const std::string& pattern);

// All matches, without their groups.
std::vector<std::string> all_matches(const std::string& text, const std::string& pattern);

// The text without its matches.
std::string without_matches(const std::string& text, const std::string& pattern);

}  // namespace splid::test
