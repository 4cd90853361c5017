#include "config/sections.hpp"

#include <algorithm>

namespace splid {
namespace {

void describe_source(Config& config, OptionVisitor& visitor) {
  const std::vector<std::string> drivers = source_names();
  std::vector<const char*> names;
  names.reserve(drivers.size());
  for (const std::string& driver : drivers) names.push_back(driver.c_str());

  const auto current = std::find(drivers.begin(), drivers.end(), config.source_driver);
  const bool is_made = config.source != nullptr && current != drivers.end();
  auto index = static_cast<std::size_t>(is_made ? current - drivers.begin() : 0);
  visitor.require("driver");
  visitor.choice("driver", index, names, "name of the driver");
  if (!is_made || drivers.at(index) != config.source_driver) {
    config.source_driver = drivers.at(index);
    config.source = make_source_options(config.source_driver);
  }
  config.source->describe(visitor);
}

template <class Options>
void section(OptionVisitor& visitor, const char* key, Options& options, const char* doc) {
  visitor.object(
      key, [&](OptionVisitor& members) { options.describe(members); }, doc);
}

}  // namespace

void describe_sections(Config& config, OptionVisitor& visitor) {
  visitor.require("source");
  visitor.object(
      "source", [&](OptionVisitor& members) { describe_source(config, members); }, source_doc);
  describe_common_sections(config, visitor);
}

void describe_common_sections(Config& config, OptionVisitor& visitor) {
  section(visitor, "channels", config.channels,
          "which inputs of the instrument mean what: sync, marker:1 to marker:15, or an input "
          "number as the instrument counts them; in a PTU the record's channel, from 0");
  visitor.objects(
      "pixels", [&](std::size_t count) { config.pixels.resize(count); },
      [&](OptionVisitor& member, std::size_t i) { config.pixels.at(i).describe(member); },
      config.pixels.size(),
      "list of directions, each with an input of the instrument, instead of channels.photon; or "
      "the name of a file with this list, as JSON or CSV");
  section(visitor, "encoder", config.encoder,
          "an encoder on the target, to compare with; its sample clock is channels.encoder");
  visitor.require("pattern");
  const auto pattern = [&](OptionVisitor& members) {
    members.require("file");
    members.path("file", config.pattern_file, "pattern file, made by splid pattern or calibrate");
  };
  visitor.object("pattern", pattern, "the pulses that the laser sends");
  section(visitor, "pulse", config.pulse, "the shape of a detected pulse");
  section(visitor, "frame", config.frame, "how the stream is cut");
  section(visitor, "scan", config.scan,
          "a scanner, whose dwells frame.by makes frames of, docs/guide/scan.md");
  section(visitor, "drift", config.drift, "how the pattern's clock is measured by its syncs");
  section(visitor, "scene", config.scene, "what the target may do");
  section(visitor, "estimator", config.estimator, "how the target is found");
  section(visitor, "detector", config.detector, "what the detector does to the photons");
  section(visitor, "pipeline", config.pipeline, "memory and threads");
  section(visitor, "publish", config.publish, "where the results go");
  section(visitor, "security", config.security, "who may connect, docs/guide/security.md");
  section(visitor, "control", config.control, "who may start and stop it, docs/guide/control.md");
  section(visitor, "metrics", config.metrics, "metrics for Prometheus, docs/reference/metrics.md");
  section(visitor, "record", config.record, "recordings of splid run");
  section(visitor, "awg", config.awg, "the waveform generator that splid upload loads");
}

}  // namespace splid
