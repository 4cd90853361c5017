#include "config/config.hpp"

#include <utility>

#include "config/endpoint.hpp"
#include "config/former_values.hpp"
#include "config/json_text.hpp"
#include "config/option_reader.hpp"
#include "config/option_writer.hpp"
#include "config/path_list.hpp"
#include "config/pattern_file.hpp"
#include "config/pixel_list.hpp"
#include "config/read_file.hpp"
#include "config/sections.hpp"
#include "protocol/error.hpp"
#include "protocol/file_kind.hpp"
#include "protocol/json_value.hpp"
#include "protocol/pattern_json.hpp"

namespace splid {
namespace {

using nlohmann::json;

[[noreturn]] void fail(const std::string& place, const std::string& what) {
  throw Error(Fault::usage, place + ": " + what);
}

void check_kind(const std::string& text, const std::string& file) {
  constexpr std::string_view blank = " \t\r\n";
  if (text.find_first_not_of(blank) == std::string::npos) {
    fail(file, "is empty; a configuration begins {\"schema\":\"splid.config\", and " +
                   std::string("splid check --schema prints all that may follow"));
  }
  const auto kind = kind_of_file(text);
  if (kind && *kind != config_file_kind) fail(file, misplaced_file(text, file, "a configuration"));
}

// An error in the pattern file makes the next start fail too. It is therefore a fault of the
// configuration, and its sentence names the key.
Pattern read_pattern(const Config& config, const ReadText& read) {
  const std::string asked_by = config.file + ": /pattern/file: ";
  const std::string text = read(config.pattern_file, asked_by);
  try {
    return pattern_from_json(text, config.pattern_file);
  } catch (const Error& error) {
    throw Error(Fault::usage, asked_by + error.what());
  }
}

void check(const std::string& file, const std::string& section,
           const std::optional<OptionFault>& fault) {
  if (fault) fail(file, section + fault->pointer + ": " + fault->what);
}

std::optional<OptionFault> frame_fault(const Config& config) {
  if (auto fault = frame_by_fault(config.frame.by)) return fault;
  // The pattern's clock cannot be told from fewer than three syncs; see SyncClock.
  constexpr double min_periods = 3;
  const double period_ms = pattern_period_ps(config.pattern) * 1e-9;
  if (config.frame.length_ms >= min_periods * period_ms) return std::nullopt;
  return OptionFault{"/length_ms", shown(config.frame.length_ms) + " is below " +
                                       shown(min_periods * period_ms) +
                                       " ms, three periods of the pattern " + config.pattern_file};
}

// A pulse wider than its distance from the next one cannot be: light that is the same all the time.
std::optional<OptionFault> width_fault(const Config& config) {
  const double spacing_ps =
      pattern_period_ps(config.pattern) / static_cast<double>(pulses_per_period(config.pattern));
  if (config.pulse.sigma_ps <= spacing_ps) return std::nullopt;
  return OptionFault{"/sigma_ps", shown(plain_number(config.pulse.sigma_ps)) + " is above " +
                                      shown(plain_number(spacing_ps)) +
                                      " ps, the mean spacing of the pulses of " +
                                      config.pattern_file + "; write the width in ps"};
}

std::optional<OptionFault> pulse_fault(const Config& config) {
  if (config.pulse.shape == Shape::gaussian) {
    if (auto fault = width_fault(config)) return fault;
  }
  if (config.pulse.shape != Shape::tabulated || config.pattern.pulse) {
    return config.pulse.validate(config.estimator);
  }
  return OptionFault{"/shape", "\"tabulated\" takes the shape from the pattern, but " +
                                   config.pattern_file +
                                   " has no \"pulse\" block; make one with splid calibrate, or "
                                   "write \"gaussian\""};
}

std::optional<OptionFault> encoder_channel_fault(const Config& config) {
  const bool has_counts = !config.encoder.file.empty() || !config.encoder.address.empty();
  if (!has_counts || !config.channels.encoder.empty()) return std::nullopt;
  return OptionFault{"/encoder",
                     "\"\" names no channel, but /encoder has counts to be joined to its tags"};
}

std::optional<OptionFault> publish_fault(const Config& config) {
  if (auto fault = config.publish.validate()) return fault;
  const auto fault = config.security.endpoint_fault(config.publish.endpoint);
  if (!fault) return std::nullopt;
  return OptionFault{"/endpoint", *fault};
}

std::optional<OptionFault> control_fault(const Config& config) {
  if (auto fault = config.control.validate()) return fault;
  if (!config.control.is_tcp() || !config.security.server_key.empty()) return std::nullopt;
  return OptionFault{"/endpoint",
                     "\"" + config.control.endpoint +
                         "\" takes /security/server_key: over TCP control is encrypted, and for "
                         "those on /control/allow_list alone (docs/guide/security.md makes keys)"};
}

// The keys of channels that pixels take the place of must not be there.
void take_pixels(Config& config, json& document, const ReadText& read) {
  const auto given = document.find("pixels");
  if (given == document.end()) return;
  for (const char* key : {"photon", "delays_ps"}) {
    const json::json_pointer pointer("/channels/" + std::string(key));
    if (!document.contains(pointer)) continue;
    fail(config.file, pointer.to_string() +
                          ": is given, and /pixels too, which takes its place; "
                          "remove one of the two");
  }
  auto [file, pixels] = read_pixel_list(*given, config.file, read);
  config.pixels_file = std::move(file);
  config.pixels = std::move(pixels);
  for (const PixelOptions& pixel : config.pixels) {
    config.channels.pixels.push_back(pixel.input);
    config.channels.delays_ps.push_back(pixel.delay_ps);
  }
  if (config.pixels.size() == 1) config.channels.photon = {std::to_string(config.pixels[0].input)};
  document.erase(given);
}

void check_all(const Config& config) {
  check(config.file, "/source", config.source->validate());
  check(config.file, "", pixel_list_fault(config));
  check(config.file, "/channels", config.channels.validate());
  check(config.file, "/encoder", config.encoder.validate());
  check(config.file, "/channels", encoder_channel_fault(config));
  check(config.file, "/security", config.security.validate());
  check(config.file, "/publish", publish_fault(config));
  check(config.file, "/control", control_fault(config));
  check(config.file, "/metrics", config.metrics.validate());
  check(config.file, "/record", config.record.validate());
  check(config.file, "/awg", config.awg.validate());
  check(config.file, "/frame", frame_fault(config));
  check(config.file, "/scan", config.scan.validate(config.channels));
  check(config.file, "/drift", config.drift.validate());
  check(config.file, "/detector", config.detector.validate());
  check(config.file, "/estimator", config.estimator.validate(config.scene));
  check(config.file, "/pulse", pulse_fault(config));
  check(config.file, "", written_file_fault(config));
}

}  // namespace

Config load_config(const std::string& file) {
  return config_from_json(read_file(file), file, read_file, shipped_patterns_folder());
}

Config config_from_json(const std::string& text, const std::string& file, const ReadText& read,
                        const std::string& shipped_patterns) {
  check_kind(text, file);
  json document = parse_json_text(text, file);
  Config config;
  config.file = file;
  config.notes = replace_former_values(document, file);
  if (document.is_object()) take_pixels(config, document, read);
  OptionReader reader(document, file, "");
  reader.need("schema", "add \"schema\":\"splid.config\"");
  read_header(reader, file, config_schema_name, config_major_version);
  describe_sections(config, reader);
  reader.finish();
  for (std::string* endpoint :
       {&config.publish.endpoint, &config.publish.local_endpoint, &config.control.endpoint}) {
    *endpoint = numeric_endpoint(*endpoint);
  }
  const auto written = document["pattern"]["file"].get<std::string>();
  PatternFile found =
      find_pattern_file(config.pattern_file, written, shipped_patterns, file + ": /pattern/file: ");
  config.pattern_file = std::move(found.path);
  if (!found.note.empty()) config.notes.push_back(std::move(found.note));
  config.pattern = read_pattern(config, read);
  check_all(config);
  return config;
}

std::string config_to_json(const Config& config) {
  nlohmann::ordered_json document;
  document["schema"] = config_schema_name;
  document["v"] = {config_major_version, config_minor_version};
  OptionWriter writer(document);
  // describe() takes options that may be changed, since readers change them. A writer does not.
  describe_sections(const_cast<Config&>(config), writer);
  if (config.pixels.empty()) {
    document.erase("pixels");
  } else {
    for (const char* key : {"photon", "delays_ps"}) document["channels"].erase(key);
  }
  return json_text(document);
}

}  // namespace splid
