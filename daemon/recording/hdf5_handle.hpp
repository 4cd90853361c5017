#pragma once

#include <hdf5.h>

#include <stdexcept>

namespace splid::recording {

// A handle of the HDF5 library's, with the function that gives it back.
//
// Threads: one, as the library has it. Errors: std::runtime_error where the library gave none.
class Hdf5Handle {
 public:
  Hdf5Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {
    if (id < 0) throw std::runtime_error("the HDF5 library refuses a call; is memory full?");
  }
  ~Hdf5Handle() { close_(id_); }
  Hdf5Handle(const Hdf5Handle&) = delete;
  Hdf5Handle& operator=(const Hdf5Handle&) = delete;
  operator hid_t() const { return id_; }  // NOLINT(google-explicit-constructor): passed to H5*()

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

}  // namespace splid::recording
