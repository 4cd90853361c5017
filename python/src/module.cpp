#include <pybind11/pybind11.h>

#include <exception>

#include "protocol/error.hpp"
#include "protocol/shown_text.hpp"
#include "python/src/bindings.hpp"

namespace splid::python {
namespace {

// The class for each Fault. They are never freed: the interpreter may be gone before this library.
struct ErrorTypes {
  py::handle usage, device, data;

  [[nodiscard]] py::handle of(Fault fault) const {
    if (fault == Fault::usage) return usage;
    return fault == Fault::device ? device : data;
  }
};
ErrorTypes error_types;

// Each exception has one sentence, which is the program's own.
void bind_errors(py::module_& module) {
  const auto add = [&](const char* name, py::handle base, const char* doc) {
    const py::handle type = py::exception<Error>(module, name, base).release();
    type.attr("__doc__") = doc;
    return type;
  };
  const py::handle base =
      add("SplidError", PyExc_Exception,
          "What went wrong: what was given, what was expected, and what to do.");
  error_types = {
      add("UsageError", base, "A configuration or an argument is at fault."),
      add("DeviceError", base, "An instrument, a socket or a disk is at fault."),
      add("DataError", base, "The content of a recording, a pattern or a message is at fault.")};
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Error& error) {
      PyErr_SetString(error_types.of(error.fault()).ptr(),
                      shown_text(error.what(), most_said).c_str());
    }
  });
}

}  // namespace
}  // namespace splid::python

PYBIND11_MODULE(_splid, module) {
  namespace bound = splid::python;
  module.attr("__version__") = SPLID_VERSION;
  bound::bind_errors(module);
  bound::bind_log(module);
  bound::bind_config(module);
  bound::bind_pattern(module);
  bound::bind_recording(module);
  bound::bind_frames(module);
  bound::bind_estimator(module);
  bound::bind_scene(module);
  bound::bind_studies(module);
}
