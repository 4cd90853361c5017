#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "config/config.hpp"
#include "protocol/tag.hpp"

// python/src/ is the module splid._splid: what splid/*.py, which people import, is made of. The
// documentation of each call stands there. A file binds one matter; this header says what they
// share.
//
// Every call that may take longer than a few milliseconds releases the interpreter's lock, and asks
// for signals (Interrupt) so that Ctrl-C ends it.

namespace splid::python {

namespace py = pybind11;

void bind_log(py::module_& module);
void bind_config(py::module_& module);
void bind_pattern(py::module_& module);
void bind_recording(py::module_& module);
void bind_frames(py::module_& module);
void bind_estimator(py::module_& module);
void bind_scene(py::module_& module);
void bind_studies(py::module_& module);

// A configuration as text, which is read anew for each use: a Config cannot be copied, and a
// pattern file may have changed meanwhile.
struct ConfigText {
  std::string text;
  std::string file;              // its name; relative paths in it are relative to this file
  std::string shipped_patterns;  // folder of patterns to fall back to; empty: none

  // Errors: as config_from_json().
  [[nodiscard]] Config read() const;
};

// Looks for signals now and then while the lock is released. Threads: the interpreter's.
class Interrupt {
 public:
  // False once a signal's handler has raised; raise() then throws what it raised.
  bool go_on();
  // Errors: py::error_already_set. With the lock held.
  void raise_if_interrupted() const;

 private:
  std::chrono::steady_clock::time_point asked_ = std::chrono::steady_clock::now();
  bool interrupted_ = false;
};

// The layout of a Tag as a numpy type. It has no gaps, since numpy leaves gaps out of what it
// joins.
py::dtype tag_type();

// The tags of an array without copying them, valid as long as the array is.
// Errors: TypeError where it is no contiguous one-dimensional array of tag_type().
std::span<const Tag> tags_of(const py::array& array);
// Errors: those of tags_of(); ValueError where the array cannot be written to.
std::span<Tag> writable_tags_of(py::array& array);

using Times = py::array_t<std::int64_t, py::array::c_style>;
std::span<const std::int64_t> times_of(const Times& array);

// An array that owns `items`: nothing is copied.
template <class T>
py::array to_array(const py::dtype& type, std::vector<T> items, std::size_t rows) {
  auto kept = std::make_unique<std::vector<T>>(std::move(items));
  const void* data = kept->data();
  const py::capsule owner(kept.get(),
                          [](void* owned) { delete static_cast<std::vector<T>*>(owned); });
  (void)kept.release();  // the capsule's now
  return py::array(type, {static_cast<py::ssize_t>(rows)}, {type.itemsize()}, data, owner);
}

}  // namespace splid::python
