#pragma once

#include <hdf5.h>

#include <cstdint>
#include <optional>
#include <string>

namespace splid::recording {

// Single values of an HDF5 file. Absent where there is nothing of that name, and where it is no
// single value of that kind.
//
// Threads: one, as the library has it. Errors: std::bad_alloc alone.

// A data set that holds one whole or real number. path: from the root, without a slash before it.
std::optional<double> hdf5_number(hid_t file, const std::string& path);

// How many values the data set of that name has, of any kind.
std::uint64_t hdf5_values(hid_t file, const std::string& path);

// A data set that holds one text, of fixed or variable length, up to its first NUL.
std::optional<std::string> hdf5_text(hid_t file, const std::string& path);

// The text that an attribute of an object holds. object: "/" is the root.
std::optional<std::string> hdf5_attribute(hid_t file, const std::string& object,
                                          const std::string& name);

// Whether a group or a data set of that name is there.
bool hdf5_has(hid_t file, const std::string& path);

}  // namespace splid::recording
