#include "protocol/pattern_json.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/file_kind.hpp"
#include "protocol/json_value.hpp"
#include "protocol/json_writer.hpp"
#include "protocol/nearest_name.hpp"
#include "protocol/shown_text.hpp"

namespace splid {
namespace {

using nlohmann::json;

constexpr std::array<const char*, 9> pattern_keys = {
    "schema",   "v",     "mode",        "unambiguous_delay_ps", "subperiods_ps",
    "segments", "pulse", "calibration", "calibrated_period_ps"};
constexpr std::array<const char*, 4> segment_keys = {"period_ps", "pulse_times_ps", "amplitudes",
                                                     "repeats"};
constexpr std::array<const char*, 4> pulse_keys = {"shape", "first_ps", "step_ps", "density"};
constexpr std::array<const char*, 9> calibration_keys = {
    "recording",          "seconds",        "photons",     "signal_photons", "std_period_ps",
    "std_pulse_times_ps", "std_amplitudes", "std_density", "distance_m"};
constexpr std::array<const char*, 5> mode_keys = {"baseline", "ambiguous", "mrr", "random",
                                                  "interleaved"};

// An object of the file, and its JSON pointer.
class Object {
 public:
  Object(const json& value, std::string file, std::string pointer,
         std::span<const char* const> keys)
      : value_(value), file_(std::move(file)), pointer_(std::move(pointer)) {
    if (!value.is_object()) fail(pointer_, shown(value) + "; it must be an object");
    for (const auto& item : value.items()) {
      const std::string& key = item.key();
      const bool known =
          std::any_of(keys.begin(), keys.end(), [&key](const char* name) { return key == name; });
      if (!known) fail(pointer_ + "/" + key, "unknown member" + suggest_name(key, keys));
    }
  }

  [[nodiscard]] bool has(const char* key) const { return value_.contains(key); }

  [[nodiscard]] double number(const char* key) const {
    return number_at(required(key), place(key));
  }

  [[nodiscard]] std::int64_t integer(const char* key) const {
    const json& value = required(key);
    const bool fits = value.is_number_integer() &&
                      (!value.is_number_unsigned() || value.get<std::uint64_t>() <= INT64_MAX);
    if (!fits) fail(place(key), shown(value) + "; it must be a whole number");
    return value.get<std::int64_t>();
  }

  [[nodiscard]] std::string text(const char* key) const {
    const json& value = required(key);
    if (!value.is_string()) fail(place(key), shown(value) + "; it must be a string");
    return value.get<std::string>();
  }

  [[nodiscard]] std::vector<double> numbers(const char* key) const {
    const json& values = array(key);
    std::vector<double> numbers;
    numbers.reserve(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      numbers.push_back(number_at(values[i], place(key) + "/" + std::to_string(i)));
    }
    return numbers;
  }

  [[nodiscard]] const json& array(const char* key) const {
    const json& values = required(key);
    if (!values.is_array()) fail(place(key), shown(values) + "; it must be an array");
    return values;
  }

  [[nodiscard]] Object member(const json& value, const std::string& pointer,
                              std::span<const char* const> keys) const {
    return {value, file_, pointer_ + pointer, keys};
  }

  [[nodiscard]] const json& required(const char* key) const {
    if (!has(key)) fail(place(key), "missing; a pattern needs it");
    return value_.at(key);
  }

  [[nodiscard]] std::string place(const char* key) const { return pointer_ + "/" + key; }

  [[noreturn]] void fail(const std::string& pointer, const std::string& what) const {
    throw Error(Fault::data, file_ + ": " + pointer + ": " + what);
  }

  // A value as an error's sentence shows it: the start of its JSON, on one line.
  static std::string shown(const json& value) {
    std::string text = json_text(value);
    if (text.size() > 60) text = text.substr(0, 57) + "...";
    return text;
  }

 private:
  [[nodiscard]] double number_at(const json& value, const std::string& pointer) const {
    if (!value.is_number()) fail(pointer, shown(value) + "; it must be a number");
    return value.get<double>();
  }

  const json& value_;
  std::string file_;
  std::string pointer_;
};

void check_kind(const std::string& text, const std::string& file) {
  const auto kind = kind_of_file(text);
  if (!kind || *kind == pattern_file_kind) return;
  throw Error(Fault::data, file + ": " + misplaced_file(text, file, "a pattern file"));
}

json parse(const std::string& text, const std::string& file) {
  constexpr std::size_t max_depth = 16;
  if (json_depth(text) > max_depth) {
    throw Error(Fault::data, file + ": nested too deeply for a pattern");
  }
  try {
    return json_value(text);
  } catch (const json::parse_error& error) {
    // The library's sentence names line and column after a code that people need not see.
    const std::string_view what = error.what();
    const std::size_t start = what.find("] ");
    const std::string sentence(what.substr(start == what.npos ? 0 : start + 2));
    throw Error(Fault::data, file + ": not JSON: " + shown_text(sentence, 2 * most_quoted));
  } catch (const json::out_of_range& error) {
    throw Error(Fault::data, file + ": a number is too large for a double: " + error.what());
  }
}

void check_schema(const Object& object) {
  const std::string schema = object.text("schema");
  if (schema != "splid.pattern") {
    object.fail("/schema", schema + "; a pattern file has splid.pattern here");
  }
  const json& version = object.array("v");
  const bool numbers =
      version.size() == 2 && version[0].is_number_unsigned() && version[1].is_number_unsigned();
  if (!numbers) object.fail("/v", Object::shown(version) + "; it must be [major,minor]");
  if (version[0] != 1) {
    object.fail("/v", Object::shown(version) + "; this program reads version 1 of pattern files");
  }
}

Mode read_mode(const Object& object) {
  const std::string name = object.text("mode");
  const auto mode = mode_from_string(name);
  if (!mode) object.fail("/mode", name + " is no mode" + suggest_name(name, mode_keys));
  return *mode;
}

PatternSegment read_segment(const Object& object) {
  PatternSegment segment;
  segment.period_ps = object.number("period_ps");
  segment.pulse_times_ps = object.numbers("pulse_times_ps");
  segment.amplitudes = object.has("amplitudes")
                           ? object.numbers("amplitudes")
                           : std::vector<double>(segment.pulse_times_ps.size(), 1.0);
  if (object.has("repeats")) segment.repeats = object.integer("repeats");
  return segment;
}

TabulatedPulse read_pulse(const Object& object) {
  const std::string shape = object.text("shape");
  if (shape != "tabulated") {
    object.fail("/pulse/shape", shape + "; a pattern file has tabulated here");
  }
  return {object.number("first_ps"), object.number("step_ps"), object.numbers("density")};
}

CalibrationFacts read_calibration(const Object& object) {
  CalibrationFacts facts;
  facts.recording = object.text("recording");
  facts.seconds = object.number("seconds");
  const std::int64_t photons = object.integer("photons");
  if (photons < 0) {
    object.fail("/calibration/photons", std::to_string(photons) + "; it must be at least 0");
  }
  facts.photons = static_cast<std::uint64_t>(photons);
  facts.signal_photons = object.number("signal_photons");
  facts.std_period_ps = object.number("std_period_ps");
  facts.std_pulse_times_ps = object.numbers("std_pulse_times_ps");
  facts.std_amplitudes = object.numbers("std_amplitudes");
  facts.std_density = object.numbers("std_density");
  if (object.has("distance_m")) facts.distance_m = object.number("distance_m");
  return facts;
}

std::string segment_json(const PatternSegment& segment) {
  return JsonWriter()
      .number("period_ps", segment.period_ps)
      .raw("pulse_times_ps", json_numbers(segment.pulse_times_ps))
      .raw("amplitudes", json_numbers(segment.amplitudes))
      .integer("repeats", segment.repeats)
      .finish();
}

std::string pulse_json(const TabulatedPulse& pulse) {
  return JsonWriter()
      .text("shape", "tabulated")
      .number("first_ps", pulse.first_ps)
      .number("step_ps", pulse.step_ps)
      .raw("density", json_numbers(pulse.density))
      .finish();
}

std::string calibration_json(const CalibrationFacts& facts) {
  return JsonWriter()
      .text("recording", facts.recording)
      .number("seconds", facts.seconds)
      .integer("photons", facts.photons)
      .number("signal_photons", facts.signal_photons)
      .number("std_period_ps", facts.std_period_ps)
      .raw("std_pulse_times_ps", json_numbers(facts.std_pulse_times_ps))
      .raw("std_amplitudes", json_numbers(facts.std_amplitudes))
      .raw("std_density", json_numbers(facts.std_density))
      .number("distance_m", facts.distance_m)
      .finish();
}

// Puts each member of the outermost object, and each segment, on a line of its own.
std::string lines_of(const std::string& line) {
  std::string text;
  int depth = 0;
  bool is_text = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"') is_text = !is_text;
    if (is_text) {
      text += c;
      if (c == '\\') text += line[++i];
      continue;
    }
    if (c == '}' || c == ']') --depth;
    if (c == '}' && depth == 0) text += '\n';
    text += c;
    if (c == '{' || c == '[') ++depth;
    if (c == '{' && depth == 1) text += "\n  ";
    if (c == ',') text += depth == 1 ? "\n  " : line[i + 1] == '{' ? "\n    " : " ";
    if (c == ':') text += ' ';
  }
  return text + "\n";
}

}  // namespace

Pattern pattern_from_json(const std::string& text, const std::string& file) {
  check_kind(text, file);
  const json parsed = parse(text, file);
  const Object object(parsed, file, "", pattern_keys);
  check_schema(object);
  Pattern pattern;
  pattern.mode = read_mode(object);
  pattern.unambiguous_delay_ps = object.number("unambiguous_delay_ps");
  if (object.has("subperiods_ps")) pattern.subperiods_ps = object.numbers("subperiods_ps");
  const json& segments = object.array("segments");
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const std::string pointer = "/segments/" + std::to_string(i);
    pattern.segments.push_back(read_segment(object.member(segments[i], pointer, segment_keys)));
  }
  if (object.has("calibrated_period_ps")) {
    pattern.calibrated_period_ps = object.number("calibrated_period_ps");
  }
  if (object.has("pulse")) {
    pattern.pulse = read_pulse(object.member(object.required("pulse"), "/pulse", pulse_keys));
  }
  if (object.has("calibration")) {
    pattern.calibration = read_calibration(
        object.member(object.required("calibration"), "/calibration", calibration_keys));
  }
  if (const auto fault = validate(pattern)) throw Error(Fault::data, file + ": " + *fault);
  return pattern;
}

std::string to_json(const Pattern& pattern) {
  JsonWriter writer;
  writer.text("schema", "splid.pattern").raw("v", "[1,0]").text("mode", to_string(pattern.mode));
  writer.number("unambiguous_delay_ps", pattern.unambiguous_delay_ps);
  if (!pattern.subperiods_ps.empty()) {
    writer.raw("subperiods_ps", json_numbers(pattern.subperiods_ps));
  }
  std::string segments;
  for (const PatternSegment& segment : pattern.segments) {
    if (!segments.empty()) segments += ',';
    segments += segment_json(segment);
  }
  writer.raw("segments", "[" + segments + "]");
  writer.number("calibrated_period_ps", pattern.calibrated_period_ps);
  if (pattern.pulse) writer.raw("pulse", pulse_json(*pattern.pulse));
  if (pattern.calibration) writer.raw("calibration", calibration_json(*pattern.calibration));
  return writer.finish();
}

std::string to_json_file(const Pattern& pattern) { return lines_of(to_json(pattern)); }

}  // namespace splid
