#pragma once

#include <cstddef>
#include <string>

namespace splid {

// A whole file that a person named.
// Errors: Error(Fault::usage) with the file and the errno text where it cannot be read.
std::string read_file(const std::string& file);

// Its first bytes, at most count; likewise.
std::string read_start(const std::string& file, std::size_t count);

// Writes a whole file, over one that is there, which stays as it was where that fails.
// Errors: Error(Fault::device) with the file and the errno text.
void write_file(const std::string& file, const std::string& text);

// Before a command does what it cannot take back, such as having a generator play, for a result
// that would then have nowhere to go. Errors: Error(Fault::usage) where `file` is there and `force`
// is not given, for a command's --force; Error(Fault::device) where its folder is not there, or it
// cannot be written.
void check_may_write(const std::string& file, bool force);

// Before minutes of work whose result would have nowhere to go. Nothing for an empty name.
// Errors: Error(Fault::device) where the file's folder does not exist.
void check_folder_of(const std::string& file);

}  // namespace splid
