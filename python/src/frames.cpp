#include <pybind11/stl.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "daemon/stream/open_source.hpp"
#include "daemon/study/replay_frames.hpp"
#include "protocol/error.hpp"
#include "protocol/frame_columns.hpp"
#include "python/src/bindings.hpp"

namespace splid::python {
namespace {

// Tags that are in memory already, played as fast as they are taken.
class ArraySource final : public TagSource {
 public:
  ArraySource(std::span<const Tag> tags, std::optional<double> start_unix_s)
      : tags_(tags), info_{"tags in memory", false, start_unix_s} {}

  [[nodiscard]] SourceInfo info() const override { return info_; }

  void run(TagSink& sink, std::stop_token stop) override {
    while (!tags_.empty() && !stop.stop_requested()) {
      const std::span<Tag> room = sink.claim(tags_.size());
      if (room.empty()) return;
      std::copy_n(tags_.begin(), room.size(), room.begin());
      sink.publish(room.size());
      tags_ = tags_.subspan(room.size());
    }
  }

 private:
  std::span<const Tag> tags_;
  SourceInfo info_;
};

std::string type_text(const FrameColumn& column) {
  switch (column.type) {
    case ColumnType::number:
      return "<f8";
    case ColumnType::integer:
      return "<i8";
    case ColumnType::flag:
      return "?";
    case ColumnType::text:
      break;
  }
  return "S" + std::to_string(column.bytes);
}

// The row of a table as a numpy type.
py::dtype frame_type() {
  py::list names, formats, offsets;
  for (const FrameColumn& column : frame_columns()) {
    names.append(std::string(column.name));
    formats.append(type_text(column));
    offsets.append(column.offset);
  }
  py::dict layout;
  layout["names"] = names;
  layout["formats"] = formats;
  layout["offsets"] = offsets;
  layout["itemsize"] = frame_row_bytes();
  return py::dtype::from_args(layout);
}

py::dict frame_units() {
  py::dict units;
  for (const FrameColumn& column : frame_columns()) {
    units[py::str(std::string(column.name))] = std::string(column.unit);
  }
  return units;
}

// Measures a source, with the lock released.
py::array table_of(const Config& config, std::unique_ptr<TagSource> source) {
  std::string rows;
  Interrupt interrupt;
  try {
    const py::gil_scoped_release unlocked;
    measure_frames(
        config, std::move(source),
        [&rows](const FrameMessage& message) { append_frame_row(message, rows); },
        [&interrupt] { return interrupt.go_on(); });
  } catch (const Error&) {
    interrupt.raise_if_interrupted();
    throw;
  }
  interrupt.raise_if_interrupted();
  std::vector<char> bytes(rows.begin(), rows.end());
  return to_array(frame_type(), std::move(bytes), rows.size() / frame_row_bytes());
}

py::array frames_of_file(const ConfigText& text, const std::string& recording,
                         const std::string& counts) {
  Config config = text.read();
  read_from(recording, counts, 0, config);
  return table_of(config, open_source(config));
}

py::array frames_of_tags(const ConfigText& text, const py::array& tags,
                         std::optional<double> start_unix_s) {
  Config config = text.read();
  return table_of(config, std::make_unique<ArraySource>(tags_of(tags), start_unix_s));
}

}  // namespace

void bind_frames(py::module_& module) {
  module.def("frame_type", &frame_type);
  module.def("frame_units", &frame_units);
  module.def("frames_of_file", &frames_of_file, py::arg("config"), py::arg("recording"),
             py::arg("counts"));
  module.def("frames_of_tags", &frames_of_tags, py::arg("config"), py::arg("tags"),
             py::arg("start_unix_s"));
}

}  // namespace splid::python
