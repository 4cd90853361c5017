#pragma once

#include <string>

namespace splid {

// The text with "(a key?)" in the place of all that may be CURVE key material: 36 or more
// characters of Z85 in a row, of which at least two are unusual in the name of a file. (A key has
// 40 characters, nine of them unusual on average. A key that was written where a path belongs may
// have lost one or two.)
std::string hide_keys(const std::string& text);

}  // namespace splid
