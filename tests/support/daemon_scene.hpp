#pragma once

#include <memory>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "protocol/pattern_make.hpp"

namespace splid {

// A configuration as load_config would make it, of the default scene, without files.
inline Config scene_config(double seconds, std::int64_t threads = 1) {
  Config config;
  config.file = "scene.json";
  config.pattern_file = "patterns/interleaved.json";
  config.source_driver = "simulator";
  const std::vector<double> subperiods_ps{180'000, 189'000};
  config.pattern = make_interleaved(subperiods_ps);
  auto scene = std::make_unique<simulator::Options>();
  scene->pace = simulator::Speed::max;
  scene->seconds = seconds;
  config.source = std::move(scene);
  config.pipeline.estimation_threads = threads;
  config.pipeline.ring_capacity_tags = 1 << 17;
  config.publish.endpoint = "tcp://127.0.0.1:*";
  return config;
}

inline std::unique_ptr<TagSource> open_scene(const Config& config) {
  SourceContext context;
  context.pattern = &config.pattern;
  context.warn = [](const std::string&) {};
  return config.source->open(context);
}

// A frame's JSON without the two times that depend on the machine.
inline std::string repeatable(std::string json) {
  const auto begin = json.find(",\"compute_ms\"");
  return begin == std::string::npos ? json : json.substr(0, begin);
}

}  // namespace splid
