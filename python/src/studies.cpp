#include <pybind11/stl.h>

#include <cmath>
#include <stop_token>

#include "daemon/study/calibration/calibration_report.hpp"
#include "daemon/study/calibration/pattern_calibration.hpp"
#include "daemon/study/calibration/side_lobe_report.hpp"
#include "estimator/calibration/shape_stack.hpp"
#include "estimator/likelihood/bound.hpp"
#include "estimator/model/units.hpp"
#include "protocol/error.hpp"
#include "python/src/bindings.hpp"

namespace splid::python {
namespace {

void check_scene(const BoundScene& scene) {
  const auto require = [](bool holds, const std::string& what) {
    if (!holds) throw Error(Fault::usage, what);
  };
  require(scene.length_ns > 0 && std::isfinite(scene.length_ns), "length_ms: must be above 0");
  require(scene.seen_ns > 0 && scene.seen_ns <= scene.length_ns,
          "seen_fraction: must be above 0 and at most 1");
  require(scene.signal_per_pulse > 0 && std::isfinite(scene.signal_per_pulse),
          "signal_per_pulse: must be above 0");
  require(scene.background_per_ns >= 0 && std::isfinite(scene.background_per_ns),
          "background_per_s: must be at least 0");
}

Bound bound(const Pattern& pattern, double sigma_ps, bool tabulated, const BoundScene& scene) {
  check_scene(scene);
  if (tabulated && !pattern.pulse) {
    throw Error(Fault::usage,
                "pulse: \"tabulated\" takes the shape from the pattern, but it has "
                "none; give sigma_ps, or a pattern made by calibrate()");
  }
  if (!tabulated && !(sigma_ps > 0)) throw Error(Fault::usage, "sigma_ps: must be above 0");
  const PulseOptions pulse{tabulated ? Shape::tabulated : Shape::gaussian, sigma_ps};
  const auto shape = calibration::shape_of(pattern, pulse);
  const py::gil_scoped_release unlocked;
  return cramer_rao_bound(pattern, *shape, scene);
}

BoundScene scene_from(double length_ms, double seen_fraction, double delay_ns, double velocity_mps,
                      double signal_per_pulse, double background_per_s, bool moving,
                      bool accelerating) {
  const double length_ns = length_ms * 1e6;
  return {length_ns,        length_ns * seen_fraction, delay_ns, velocity_mps,
          signal_per_pulse, background_per_s * 1e-9,   moving,   accelerating};
}

py::dict stacked(const calibration::PatternCalibration& made) {
  const calibration::PhotonDensity density = calibration::photon_density(made);
  const auto array = [](const std::vector<double>& values) {
    return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
  };
  py::dict all;
  all["offset_ps"] = array(density.offset_ps);
  all["density_per_ns"] = array(density.density_per_ns);
  all["std_per_ns"] = array(density.std_per_ns);
  return all;
}

// The pattern, the table and the summary for people, and the photons laid upon each other.
py::tuple calibrate(const ConfigText& text, const std::string& recording,
                    std::optional<double> distance_m, double time_ps, double amplitude_percent) {
  const Config config = text.read();
  calibration::Plan plan;
  plan.recording = recording;
  plan.distance_m = distance_m;
  plan.goal.std_time_ps = time_ps;
  plan.goal.std_amplitude = amplitude_percent / 100;
  Interrupt interrupt;
  std::stop_source stop;
  const auto look = [&](const char* /*doing*/, double /*seconds*/) {
    if (!interrupt.go_on()) stop.request_stop();
  };
  const calibration::PatternCalibration made = [&] {
    try {
      const py::gil_scoped_release unlocked;
      return calibration::calibrate_recording(config, recording, plan, look, stop.get_token());
    } catch (const Error&) {
      interrupt.raise_if_interrupted();
      throw;
    }
  }();
  return py::make_tuple(made.pattern, calibration::pulse_table(made.pattern),
                        calibration::summary(made, "the pattern's file", config.frame.length_ms),
                        stacked(made));
}

}  // namespace

void bind_studies(py::module_& module) {
  py::class_<Bound>(module, "Bound")
      .def_readonly("delay_ns", &Bound::delay_ns)
      .def_readonly("delay_start_ns", &Bound::delay_start_ns)
      .def_readonly("velocity_mps", &Bound::velocity_mps)
      .def_readonly("signal_per_pulse", &Bound::signal_per_pulse)
      .def_property_readonly("background_per_s",
                             [](const Bound& self) { return self.background_per_ns * 1e9; })
      .def_readonly("acceleration_mps2", &Bound::acceleration_mps2);
  py::class_<BoundScene>(module, "BoundScene")
      .def(py::init(&scene_from), py::kw_only(), py::arg("length_ms"), py::arg("seen_fraction"),
           py::arg("delay_ns"), py::arg("velocity_mps"), py::arg("signal_per_pulse"),
           py::arg("background_per_s"), py::arg("moving"), py::arg("accelerating"));
  module.def("bound", &bound, py::arg("pattern"), py::arg("sigma_ps"), py::arg("tabulated"),
             py::arg("scene"));
  module.def("calibrate", &calibrate, py::arg("config"), py::arg("recording"),
             py::arg("distance_m"), py::arg("time_ps"), py::arg("amplitude_percent"));
}

}  // namespace splid::python
