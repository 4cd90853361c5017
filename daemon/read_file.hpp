#pragma once

#include <cstddef>
#include <string>

namespace splid {

// A whole file that a person named.
// Errors: Error(Fault::usage) with the file and the errno text where it cannot be read.
std::string read_file(const std::string& file);

// Its first bytes, at most count; likewise.
std::string read_start(const std::string& file, std::size_t count);

}  // namespace splid
