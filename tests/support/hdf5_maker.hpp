#pragma once

#include <hdf5.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

// HDF5 files as the library of their makers writes them.

namespace splid::test {

// How an array is laid out in its file.
struct ArrayForm {
  std::uint64_t chunk = 0;  // values in one; 0: no chunks
  int deflate = -1;         // level; -1: not packed
  bool shuffle = false;
  bool checksums = false;  // fletcher32

  static ArrayForm packed(std::uint64_t values) { return {values, 6, true, false}; }
};

class Hdf5Maker {
 public:
  // newest: writes the newest form of the file that the library knows, rather than the oldest form.
  explicit Hdf5Maker(const std::string& file, bool newest = false) {
    const hid_t how = H5Pcreate(H5P_FILE_ACCESS);
    if (newest) H5Pset_libver_bounds(how, H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
    file_ = checked(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, how));
    H5Pclose(how);
    links_ = checked(H5Pcreate(H5P_LINK_CREATE));
    H5Pset_create_intermediate_group(links_, 1);
  }
  ~Hdf5Maker() {
    H5Pclose(links_);
    H5Fclose(file_);
  }
  Hdf5Maker(const Hdf5Maker&) = delete;
  Hdf5Maker& operator=(const Hdf5Maker&) = delete;

  [[nodiscard]] hid_t file() const { return file_; }

  // An attribute of an object. is_variable: as h5py writes text; else as PyTables does.
  void attribute(const char* object, const char* name, const std::string& value,
                 bool is_variable = false) {
    const hid_t type = text_type(is_variable ? H5T_VARIABLE : value.size());
    const hid_t space = H5Screate(H5S_SCALAR);
    const hid_t where = checked(H5Oopen(file_, object, H5P_DEFAULT));
    const hid_t made = checked(H5Acreate2(where, name, type, space, H5P_DEFAULT, H5P_DEFAULT));
    const char* text = value.c_str();
    checked(H5Awrite(made, type, is_variable ? static_cast<const void*>(&text) : text));
    H5Aclose(made);
    H5Oclose(where);
    H5Sclose(space);
    H5Tclose(type);
  }

  void text(const char* path, const std::string& value, bool is_variable = false) {
    const hid_t type = text_type(is_variable ? H5T_VARIABLE : value.size());
    const char* text = value.c_str();
    write(path, type, type, {}, is_variable ? static_cast<const void*>(&text) : text, {});
    H5Tclose(type);
  }

  void number(const char* path, double value) {
    write(path, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, {}, &value, {});
  }

  template <class Number>
  void array(const char* path, const std::vector<Number>& values, const ArrayForm& form = {}) {
    write(path, native<Number>(), native<Number>(), {values.size()}, values.data(), form);
  }

  // A data set of any type and extent; empty: of one value.
  void write(const char* path, hid_t type, hid_t memory_type, const std::vector<hsize_t>& extent,
             const void* values, const ArrayForm& form) {
    const hid_t how = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_obj_track_times(how, false);
    const hsize_t chunk = form.chunk;
    if (chunk > 0) checked(H5Pset_chunk(how, 1, &chunk));
    if (form.shuffle) checked(H5Pset_shuffle(how));
    if (form.deflate >= 0) checked(H5Pset_deflate(how, static_cast<unsigned>(form.deflate)));
    if (form.checksums) checked(H5Pset_fletcher32(how));
    const hid_t space =
        extent.empty() ? H5Screate(H5S_SCALAR)
                       : H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr);
    const hid_t made =
        checked(H5Dcreate2(file_, path, type, checked(space), links_, how, H5P_DEFAULT));
    checked(H5Dwrite(made, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values));
    H5Dclose(made);
    H5Sclose(space);
    H5Pclose(how);
  }

  // Puts bytes in the place of a chunk, as if they had come out of its filters.
  void replace_chunk(const char* path, hsize_t first, const std::string& bytes) {
    const hid_t array = checked(H5Dopen2(file_, path, H5P_DEFAULT));
    checked(H5Dwrite_chunk(array, H5P_DEFAULT, 0, &first, bytes.size(), bytes.data()));
    H5Dclose(array);
  }

 private:
  template <class Result>
  static Result checked(Result result) {
    if (result < 0) throw std::runtime_error("the HDF5 library refuses what the test asks for");
    return result;
  }

  static hid_t text_type(std::size_t bytes) {
    const hid_t type = checked(H5Tcopy(H5T_C_S1));
    checked(H5Tset_size(type, bytes));
    return type;
  }

  template <class Number>
  static hid_t native() {
    constexpr bool is_signed = std::is_signed_v<Number>;
    switch (sizeof(Number)) {
      case 1:
        return is_signed ? H5T_NATIVE_INT8 : H5T_NATIVE_UINT8;
      case 2:
        return is_signed ? H5T_NATIVE_INT16 : H5T_NATIVE_UINT16;
      case 4:
        return is_signed ? H5T_NATIVE_INT32 : H5T_NATIVE_UINT32;
      default:
        return is_signed ? H5T_NATIVE_INT64 : H5T_NATIVE_UINT64;
    }
  }

  hid_t file_ = -1;
  hid_t links_ = -1;
};

// The arrays of a Photon-HDF5 file, and what stands beside them.
struct PhotonArrays {
  std::vector<std::int64_t> timestamps;
  std::vector<std::uint8_t> detectors;   // empty: none
  std::vector<std::uint16_t> nanotimes;  // empty: none
  double unit_s = 1e-12;
  double laser_hz = 0;  // 0: not told
  double step_s = 16e-12;
  double bins = 4096;
  std::string group = "photon_data";
  ArrayForm form;
};

inline void add_photons(Hdf5Maker& maker, const PhotonArrays& arrays) {
  const auto path = [&](const char* name) { return arrays.group + "/" + name; };
  maker.array(path("timestamps").c_str(), arrays.timestamps, arrays.form);
  maker.number(path("timestamps_specs/timestamps_unit").c_str(), arrays.unit_s);
  if (!arrays.detectors.empty()) {
    maker.array(path("detectors").c_str(), arrays.detectors, arrays.form);
  }
  if (arrays.laser_hz > 0) {
    maker.number(path("measurement_specs/laser_repetition_rate").c_str(), arrays.laser_hz);
  }
  if (arrays.nanotimes.empty()) return;
  maker.array(path("nanotimes").c_str(), arrays.nanotimes, arrays.form);
  maker.number(path("nanotimes_specs/tcspc_unit").c_str(), arrays.step_s);
  maker.number(path("nanotimes_specs/tcspc_num_bins").c_str(), arrays.bins);
  maker.number(path("nanotimes_specs/tcspc_range").c_str(), arrays.bins * arrays.step_s);
}

// What phconvert writes beside the photons.
inline void add_photon_facts(Hdf5Maker& maker) {
  maker.attribute("/", "format_name", "Photon-HDF5");
  maker.attribute("/", "format_version", "0.5");
  maker.number("acquisition_duration", 1.5);
  maker.text("description", "a comment");
  maker.text("identity/software", "phconvert");
  maker.text("identity/creation_time", "2026-11-23 10:11:12");
}

inline void write_photon_hdf5(const std::string& file, const PhotonArrays& arrays,
                              bool newest = false) {
  Hdf5Maker maker(file, newest);
  add_photon_facts(maker);
  add_photons(maker, arrays);
}

}  // namespace splid::test
