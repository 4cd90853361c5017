#pragma once

#include <cstddef>
#include <string>

namespace splid {

// Reads a whole file that a person named. asked_by: stands before the file in the error's sentence,
// such as the key that named it; may be empty.
// Errors: Error(Fault::usage) with the file and the errno text where it cannot be read.
std::string read_file(const std::string& file, const std::string& asked_by = "");

// Reads the first bytes of such a file, at most `count`. Errors: as read_file().
std::string read_start(const std::string& file, std::size_t count,
                       const std::string& asked_by = "");

}  // namespace splid
