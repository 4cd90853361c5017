#include "protocol/pattern.hpp"

#include <pybind11/stl.h>

#include "config/read_file.hpp"
#include "daemon/base/text.hpp"
#include "daemon/base/write_file.hpp"
#include "protocol/pattern_json.hpp"
#include "protocol/pattern_make.hpp"
#include "python/src/bindings.hpp"

namespace splid::python {
namespace {

using Numbers = py::array_t<double>;

Numbers array_of(const std::vector<double>& values) {
  return Numbers(static_cast<py::ssize_t>(values.size()), values.data());
}

py::list segments_of(const Pattern& pattern) {
  py::list all;
  for (const PatternSegment& segment : pattern.segments) {
    py::dict one;
    one["period_ps"] = segment.period_ps;
    one["pulse_times_ps"] = array_of(segment.pulse_times_ps);
    one["amplitudes"] = array_of(segment.amplitudes);
    one["repeats"] = segment.repeats;
    all.append(one);
  }
  return all;
}

py::object shape_of_pulse(const Pattern& pattern) {
  if (!pattern.pulse) return py::none();
  py::dict shape;
  shape["first_ps"] = pattern.pulse->first_ps;
  shape["step_ps"] = pattern.pulse->step_ps;
  shape["density"] = array_of(pattern.pulse->density);
  return shape;
}

Pattern periodic(double period_ps, std::size_t pulses, bool ambiguous) {
  return make_periodic(ambiguous ? Mode::ambiguous : Mode::baseline, period_ps, pulses);
}

Pattern random(double period_ps, std::size_t pulses, double min_spacing_ps, std::uint64_t seed,
               bool stratified) {
  const RandomPatternOptions options{period_ps, pulses, min_spacing_ps, seed};
  return stratified ? make_stratified(options) : make_random(options);
}

}  // namespace

void bind_pattern(py::module_& module) {
  py::class_<Pattern>(module, "Pattern")
      .def_static("read",
                  [](const std::string& file) { return pattern_from_json(read_file(file), file); })
      .def_static("from_json", &pattern_from_json, py::arg("text"), py::arg("file"))
      .def_static(
          "interleaved",
          [](const std::vector<double>& periods_ps) { return make_interleaved(periods_ps); })
      .def_static("random", &random)
      .def_static("periodic", &periodic)
      .def_static(
          "mrr",
          [](const std::vector<double>& periods_ps, const std::vector<std::int64_t>& repeats) {
            return make_mrr(periods_ps, repeats);
          })
      .def("json", [](const Pattern& self) { return to_json(self); })
      .def("write", [](const Pattern& self,
                       const std::string& file) { write_file(file, to_json_file(self)); })
      .def("describe", &describe_pattern)
      .def_property_readonly("mode", [](const Pattern& self) { return to_string(self.mode); })
      .def_readonly("unambiguous_delay_ps", &Pattern::unambiguous_delay_ps)
      .def_readonly("subperiods_ps", &Pattern::subperiods_ps)
      .def_readonly("calibrated_period_ps", &Pattern::calibrated_period_ps)
      .def_property_readonly("period_ps", &pattern_period_ps)
      .def_property_readonly("pulses", &pulses_per_period)
      .def_property_readonly("segments", &segments_of)
      .def_property_readonly("pulse", &shape_of_pulse)
      .def(
          "__eq__", [](const Pattern& self, const Pattern& other) { return self == other; },
          py::is_operator());
}

}  // namespace splid::python
