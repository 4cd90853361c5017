#pragma once

#include <string>

namespace splid {

// The text with "(a key?)" in the place of whatever may be CURVE key material: 36 or more of Z85's
// characters in a row, of which two are unusual in the name of a file. (A key has 40, of which nine
// on average are; a name written as a path may have lost one or two.)
std::string hide_keys(const std::string& text);

}  // namespace splid
