#include <pybind11/stl.h>

#include <limits>
#include <optional>

#include "daemon/stream/open_source.hpp"
#include "drivers/simulator/scene_truth.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "protocol/error.hpp"
#include "protocol/truth.hpp"
#include "python/src/bindings.hpp"

namespace splid::python {
namespace {

// Keeps all tags, and ends the source once a signal came.
class KeepingSink final : public TagSink {
 public:
  explicit KeepingSink(Interrupt& interrupt) : interrupt_(interrupt) {}

  std::span<Tag> claim(std::size_t max_count) override {
    if (!interrupt_.go_on()) return {};
    tags_.resize(used_ + max_count);
    return {tags_.data() + used_, max_count};
  }
  void publish(std::size_t count) override { used_ += count; }

  std::vector<Tag> take() {
    tags_.resize(used_);
    return std::move(tags_);
  }

 private:
  Interrupt& interrupt_;
  std::vector<Tag> tags_;
  std::size_t used_ = 0;
};

simulator::Options& scene_of(Config& config) {
  auto* scene = dynamic_cast<simulator::Options*>(config.source.get());
  if (scene != nullptr) return *scene;
  throw Error(Fault::usage, config.file + ": /source/driver is \"" + config.source_driver +
                                "\"; simulate needs a scene: the driver \"simulator\"");
}

// The tags, their truth, and the UTC of device time 0.
py::tuple simulate(const ConfigText& text, double seconds, std::optional<std::int64_t> seed) {
  Config config = text.read();
  simulator::Options& scene = scene_of(config);
  scene.pace = simulator::Speed::max;
  scene.seconds = seconds;
  scene.truth.clear();
  if (seed) scene.seed = *seed;
  if (const auto fault = scene.validate()) {
    throw Error(Fault::usage, config.file + ": /source" + fault->pointer + ": " + fault->what);
  }
  const std::unique_ptr<TagSource> source = open_source(config);
  Interrupt interrupt;
  KeepingSink sink(interrupt);
  SceneTruth truth;
  {
    const py::gil_scoped_release unlocked;
    source->run(sink, {});
    truth = simulator::scene_truth(scene);
  }
  interrupt.raise_if_interrupted();
  std::vector<Tag> tags = sink.take();
  const std::size_t count = tags.size();
  return py::make_tuple(to_array(tag_type(), std::move(tags), count), std::move(truth),
                        source->info().start_unix_s);
}

py::tuple states_at(const SceneTruth& truth, const Times& times_ps) {
  const auto times = times_of(times_ps);
  py::array_t<double> distance_m(times_ps.size());
  py::array_t<double> velocity_mps(times_ps.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    constexpr double outside = std::numeric_limits<double>::quiet_NaN();
    const auto state = truth.at(times[i]).value_or(SceneTruth::State{outside, outside});
    distance_m.mutable_at(i) = state.distance_m;
    velocity_mps.mutable_at(i) = state.velocity_mps;
  }
  return py::make_tuple(distance_m, velocity_mps);
}

}  // namespace

void bind_scene(py::module_& module) {
  py::class_<SceneTruth>(module, "Truth")
      .def_static("from_json", &truth_from_json, py::arg("text"))
      .def("json", [](const SceneTruth& self) { return to_json(self); })
      .def("at", &states_at, py::arg("times_ps").noconvert())
      .def_readonly("signal_per_pulse", &SceneTruth::signal_per_pulse)
      .def_readonly("background_per_s", &SceneTruth::background_per_s)
      .def_readonly("sigma_ps", &SceneTruth::sigma_ps)
      .def_readonly("electronic_delay_ns", &SceneTruth::electronic_delay_ns)
      .def_readonly("drift_ppm", &SceneTruth::drift_ppm);
  module.def("simulate", &simulate, py::arg("config"), py::arg("seconds"), py::arg("seed"));
}

}  // namespace splid::python
