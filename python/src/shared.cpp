#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "config/pattern_file.hpp"
#include "config/read_file.hpp"
#include "daemon/base/log.hpp"
#include "python/src/bindings.hpp"

namespace splid::python {
namespace {

constexpr std::chrono::milliseconds between_looks{50};

// Keeps what the program would write to its log until Python asks for it: the threads that measure
// never wait for the interpreter's lock.
class KeptLog final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  std::vector<std::pair<int, std::string>> take() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(lines_, {});
  }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    constexpr std::size_t most_lines = 1000;
    if (lines_.size() == most_lines) return;
    lines_.emplace_back(static_cast<int>(message.level),
                        std::string(message.payload.data(), message.payload.size()));
  }
  void flush_() override {}

 private:
  std::vector<std::pair<int, std::string>> lines_;
};

Tag* tag_data(const py::array& array) {
  if (!array.dtype().equal(tag_type()) || array.ndim() != 1 ||
      (array.shape(0) > 1 && array.strides(0) != sizeof(Tag))) {
    throw py::type_error("tags: an array of the type " + std::string(py::str(array.dtype())) +
                         " was given, but a contiguous one-dimensional array of splid.TAG is "
                         "expected; numpy.ascontiguousarray() makes one");
  }
  return static_cast<Tag*>(const_cast<void*>(array.data()));
}

}  // namespace

void bind_log(py::module_& module) {
  const auto kept = std::make_shared<KeptLog>();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("splid", kept));
  module.def("take_log", [kept] {
    py::list lines;
    for (const auto& [level, text] : kept->take()) lines.append(py::make_tuple(level, text));
    return lines;
  });
}

void bind_config(py::module_& module) {
  py::class_<ConfigText>(module, "Config")
      .def(py::init([](std::string text, std::string file, std::string shipped_patterns) {
             ConfigText made{std::move(text), std::move(file), std::move(shipped_patterns)};
             (void)made.read();
             return made;
           }),
           py::arg("text"), py::arg("file"), py::arg("shipped_patterns"))
      .def_readonly("file", &ConfigText::file)
      .def("json", [](const ConfigText& self) { return config_to_json(self.read()); });
  module.def("shipped_patterns_folder", &shipped_patterns_folder);
}

Config ConfigText::read() const {
  Config config = config_from_json(text, file, read_file, shipped_patterns);
  for (const std::string& note : config.notes) log_warning(note);
  return config;
}

bool Interrupt::go_on() {
  const auto now = std::chrono::steady_clock::now();
  if (interrupted_ || now - asked_ < between_looks) return !interrupted_;
  asked_ = now;
  const py::gil_scoped_acquire lock;
  interrupted_ = PyErr_CheckSignals() != 0;
  return !interrupted_;
}

void Interrupt::raise_if_interrupted() const {
  if (interrupted_) throw py::error_already_set();
}

py::dtype tag_type() {
  py::dict layout;
  layout["names"] = py::make_tuple("time_ps", "value", "kind", "reserved");
  layout["formats"] = py::make_tuple("<i8", "<i4", "u1", "V3");
  layout["offsets"] = py::make_tuple(offsetof(Tag, time_ps), offsetof(Tag, value),
                                     offsetof(Tag, kind), offsetof(Tag, reserved));
  layout["itemsize"] = sizeof(Tag);
  return py::dtype::from_args(layout);
}

std::span<const Tag> tags_of(const py::array& array) {
  return {tag_data(array), static_cast<std::size_t>(array.size())};
}

std::span<Tag> writable_tags_of(py::array& array) {
  if (!array.writeable()) throw py::value_error("tags: the array cannot be written to");
  return {tag_data(array), static_cast<std::size_t>(array.size())};
}

std::span<const std::int64_t> times_of(const Times& array) {
  if (array.ndim() != 1) throw py::value_error("times: a one-dimensional array is expected");
  return {array.data(), static_cast<std::size_t>(array.size())};
}

}  // namespace splid::python
