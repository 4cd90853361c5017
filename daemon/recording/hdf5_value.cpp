#include "daemon/recording/hdf5_value.hpp"

#include <algorithm>
#include <functional>

#include "daemon/recording/hdf5_handle.hpp"

namespace splid::recording {
namespace {

// A longer text was not written by a person.
constexpr std::size_t most_text_bytes = 1 << 20;

// Reads the one value of a data set or an attribute into `to`, in that type of memory.
using ReadValue = std::function<herr_t(hid_t memory_type, void* to)>;

std::optional<std::string> text_of(hid_t type, const ReadValue& read) {
  if (H5Tget_class(type) != H5T_STRING) return std::nullopt;
  const Hdf5Handle memory(H5Tcopy(type), H5Tclose);
  if (H5Tis_variable_str(type) > 0) {
    char* text = nullptr;
    if (read(memory, static_cast<void*>(&text)) < 0 || text == nullptr) return std::nullopt;
    std::string copy = text;
    H5free_memory(text);
    return copy;
  }
  const std::size_t bytes = H5Tget_size(type);
  if (bytes == 0 || bytes > most_text_bytes) return std::nullopt;
  std::string text(bytes, '\0');
  if (read(memory, text.data()) < 0) return std::nullopt;
  text.resize(std::min(text.find('\0'), bytes));
  return text;
}

bool is_one_value(hid_t space) { return H5Sget_simple_extent_npoints(space) == 1; }

}  // namespace

std::optional<double> hdf5_number(hid_t file, const std::string& path) {
  const hid_t found = H5Dopen2(file, path.c_str(), H5P_DEFAULT);
  if (found < 0) return std::nullopt;
  const Hdf5Handle data(found, H5Dclose);
  const Hdf5Handle type(H5Dget_type(data), H5Tclose);
  const Hdf5Handle space(H5Dget_space(data), H5Sclose);
  const H5T_class_t kind = H5Tget_class(type);
  if ((kind != H5T_INTEGER && kind != H5T_FLOAT) || !is_one_value(space)) return std::nullopt;
  double value = 0;
  if (H5Dread(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value) < 0) {
    return std::nullopt;
  }
  return value;
}

std::uint64_t hdf5_values(hid_t file, const std::string& path) {
  const hid_t found = H5Dopen2(file, path.c_str(), H5P_DEFAULT);
  if (found < 0) return 0;
  const Hdf5Handle data(found, H5Dclose);
  const Hdf5Handle space(H5Dget_space(data), H5Sclose);
  return static_cast<std::uint64_t>(std::max<hssize_t>(H5Sget_simple_extent_npoints(space), 0));
}

std::optional<std::string> hdf5_text(hid_t file, const std::string& path) {
  const hid_t found = H5Dopen2(file, path.c_str(), H5P_DEFAULT);
  if (found < 0) return std::nullopt;
  const Hdf5Handle data(found, H5Dclose);
  const Hdf5Handle type(H5Dget_type(data), H5Tclose);
  const Hdf5Handle space(H5Dget_space(data), H5Sclose);
  if (!is_one_value(space)) return std::nullopt;
  return text_of(type, [&](hid_t memory, void* to) {
    return H5Dread(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, to);
  });
}

std::optional<std::string> hdf5_attribute(hid_t file, const std::string& object,
                                          const std::string& name) {
  const hid_t found = H5Aopen_by_name(file, object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
  if (found < 0) return std::nullopt;
  const Hdf5Handle attribute(found, H5Aclose);
  const Hdf5Handle type(H5Aget_type(attribute), H5Tclose);
  const Hdf5Handle space(H5Aget_space(attribute), H5Sclose);
  if (!is_one_value(space)) return std::nullopt;
  return text_of(type, [&](hid_t memory, void* to) { return H5Aread(attribute, memory, to); });
}

bool hdf5_has(hid_t file, const std::string& path) {
  const hid_t found = H5Oopen(file, path.c_str(), H5P_DEFAULT);
  if (found < 0) return false;
  H5Oclose(found);
  return true;
}

}  // namespace splid::recording
