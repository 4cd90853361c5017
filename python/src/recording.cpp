#include <pybind11/stl.h>

#include <variant>

#include "daemon/base/log.hpp"
#include "drivers/replay/recording_info.hpp"
#include "drivers/replay/recording_reader.hpp"
#include "protocol/recording_format.hpp"
#include "python/src/bindings.hpp"

namespace splid::python {
namespace {

py::list listed_losses(const RecordingHeader& header) {
  py::list losses;
  for (const Loss& loss : header.losses) {
    losses.append(py::make_tuple(loss.begin_ps, loss.end_ps, loss.count));
  }
  return losses;
}

// The header's tags by name; one of several has its index behind its name, as in "UsrAI(2)".
py::dict tags_of_header(const RecordingHeader& header) {
  py::dict all;
  for (const PtuTag& tag : header.tags) {
    const std::string name =
        tag.index < 0 ? tag.name : tag.name + "(" + std::to_string(tag.index) + ")";
    const bool is_bytes = tag.type == PtuTagType::real_array ||
                          tag.type == PtuTagType::wide_string || tag.type == PtuTagType::blob;
    if (const auto* text = std::get_if<std::string>(&tag.value)) {
      py::bytes raw(*text);
      all[py::str(name)] =
          is_bytes ? py::object(raw)
                   : py::object(raw.attr("decode")("utf-8", py::arg("errors") = "replace"));
    } else if (const auto* real = std::get_if<double>(&tag.value)) {
      all[py::str(name)] = *real;
    } else if (tag.type == PtuTagType::boolean) {
      all[py::str(name)] = std::get<std::int64_t>(tag.value) != 0;
    } else {
      all[py::str(name)] = std::get<std::int64_t>(tag.value);
    }
  }
  return all;
}

py::dict facts_of(const RecordingHeader& header) {
  py::dict facts;
  facts["header"] = tags_of_header(header);
  facts["format"] = in_words(header.format);
  facts["record_type"] = is_pico_quant(header.format)
                             ? py::object(py::int_(static_cast<std::uint32_t>(header.record_type)))
                             : py::object(py::none());
  facts["is_t3"] = header.is_t3;
  facts["resolution_s"] = header.resolution_s;
  facts["sync_period_s"] = header.sync_period_s;
  facts["record_count"] = header.record_count;
  facts["created_unix_s"] = header.created_unix_s;
  facts["origin_ps"] = header.origin_ps;
  facts["pattern_json"] = header.pattern_json;
  facts["config_json"] = header.config_json;
  facts["losses"] = listed_losses(header);
  return facts;
}

// What of a scan is no part of the header. Inputs and markers without tags are left out.
py::dict counts_of(const RecordingInfo& info) {
  py::dict photons, markers, counts;
  for (const auto& [input, count] : info.photons) photons[py::int_(input)] = count;
  for (std::size_t i = 0; i < info.markers.size(); ++i) {
    if (info.markers[i] > 0) markers[py::int_(i)] = info.markers[i];
  }
  counts["photons"] = photons;
  counts["syncs"] = info.syncs;
  counts["markers"] = markers;
  counts["records"] = info.records;
  counts["unknown_records"] = info.unknown_records;
  counts["saturated_photons"] = info.saturated_photons;
  counts["first_ps"] = info.first_ps;
  counts["last_ps"] = info.last_ps;
  counts["steps_back"] = info.steps_back;
  counts["longest_step_back_ps"] = info.longest_step_back_ps;
  counts["whole"] = info.whole;
  counts["warnings"] = info.warnings;
  return counts;
}

py::dict scan(const std::string& file, std::uint64_t max_tags) {
  Interrupt interrupt;
  struct Stopped {};
  RecordingInfo info;
  try {
    const py::gil_scoped_release unlocked;
    info = scan_recording(file, max_tags, [&interrupt](std::span<const Tag>) {
      if (!interrupt.go_on()) throw Stopped{};
    });
  } catch (const Stopped&) {
    interrupt.raise_if_interrupted();
  }
  return counts_of(info);
}

std::size_t read(RecordingReader& reader, py::array& into) {
  const std::span<Tag> tags = writable_tags_of(into);
  if (tags.empty()) throw py::value_error("chunk: 0 tags were asked for; give 1 or more");
  const py::gil_scoped_release unlocked;
  return reader.read(tags);
}

}  // namespace

void bind_recording(py::module_& module) {
  module.def("tag_type", &tag_type);
  module.def("scan", &scan, py::arg("file"), py::arg("max_tags"));
  py::class_<RecordingReader>(module, "Reader")
      .def(py::init([](const std::string& file, double period_ps) {
             const auto warn = [](const std::string& text) { log_warning(text); };
             return std::make_unique<RecordingReader>(file, warn, period_ps);
           }),
           py::arg("file"), py::arg("period_ps"))
      .def("facts", [](const RecordingReader& self) { return facts_of(self.header()); })
      .def("read", &read, py::arg("into"));
}

}  // namespace splid::python
