#include "protocol/truth.hpp"

#include <charconv>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "protocol/error.hpp"
#include "protocol/json_value.hpp"

namespace splid {
namespace {

using nlohmann::json;

Error bad_member(const std::string& key, const std::string& problem) {
  return {Fault::data, "truth: /" + key + " " + problem};
}

// The result refers to a part of `object`, and to nothing of `key`.
const json& member(const json& object, std::string_view key) {
  const auto found = object.find(key);
  if (found == object.end()) throw bad_member(std::string(key), "is missing");
  return *found;
}

double number(const json& object, const std::string& key) {
  const json& value = member(object, key);
  if (!value.is_number()) throw bad_member(key, "is " + json_text(value) + "; must be a number");
  return value.get<double>();
}

std::int64_t whole_number(const json& object, const std::string& key) {
  const json& value = member(object, key);
  if (!value.is_number_integer()) {
    throw bad_member(key, "is " + json_text(value) + "; must be a whole number");
  }
  return value.get<std::int64_t>();
}

std::int64_t whole_number_text(const json& object, const std::string& key) {
  const json& value = member(object, key);
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    std::int64_t whole = 0;
    const char* end = text.data() + text.size();
    const auto [stopped, failure] = std::from_chars(text.data(), end, whole);
    if (failure == std::errc() && stopped == end) return whole;
  }
  throw bad_member(key, "is " + json_text(value) + "; must be a string that holds a whole number");
}

std::vector<double> numbers(const json& object, const std::string& key) {
  const json& values = member(object, key);
  if (!values.is_array()) throw bad_member(key, "must be an array of numbers");
  std::vector<double> result;
  result.reserve(values.size());
  for (const json& value : values) {
    if (!value.is_number()) {
      throw bad_member(key + "/" + std::to_string(result.size()),
                       "is " + json_text(value) + "; must be a number");
    }
    result.push_back(value.get<double>());
  }
  return result;
}

json parse(const std::string& text) {
  constexpr std::size_t max_depth = 16;
  if (json_depth(text) > max_depth) {
    throw Error(Fault::data, "truth: nested too deeply for a truth file");
  }
  try {
    json object = json_value(text);
    if (object.is_object()) return object;
  } catch (const json::parse_error& error) {
    throw Error(Fault::data, "truth: no JSON at byte " + std::to_string(error.byte) +
                                 "; simulate the scene again");
  } catch (const json::out_of_range& error) {
    throw Error(Fault::data,
                std::string("truth: a number is too large for a double: ") + error.what());
  }
  throw Error(Fault::data, "truth: must be a JSON object");
}

void check_schema(const json& object) {
  const json& schema = member(object, "schema");
  if (schema != "splid.truth") {
    throw bad_member("schema", "is " + json_text(schema) + "; must be \"splid.truth\"");
  }
  const json& version = member(object, "v");
  if (!version.is_array() || version.empty() || version[0] != 1) {
    throw bad_member("v", "is " + json_text(version) + "; this program reads [1,0]");
  }
}

void check_samples(const SceneTruth& truth) {
  if (truth.step_ps <= 0) {
    throw bad_member("step_ps", "is " + std::to_string(truth.step_ps) + "; must be above 0");
  }
  if (truth.distance_m.empty()) throw bad_member("distance_m", "is empty; must have a sample");
  if (truth.velocity_mps.size() != truth.distance_m.size()) {
    throw bad_member("velocity_mps", "has " + std::to_string(truth.velocity_mps.size()) +
                                         " samples; distance_m has " +
                                         std::to_string(truth.distance_m.size()));
  }
}

void read_more_targets(const json& object, SceneTruth& truth) {
  const auto found = object.find("more_targets");
  if (found == object.end()) return;
  if (!found->is_array()) throw bad_member("more_targets", "must be an array");
  for (const json& target : *found) {
    const std::string key = "more_targets/" + std::to_string(truth.more_targets.size());
    if (!target.is_object()) throw bad_member(key, "must be an object");
    SceneTruth::Further further;
    further.signal_per_pulse = number(target, "signal_per_pulse");
    further.distance_m = numbers(target, "distance_m");
    further.velocity_mps = numbers(target, "velocity_mps");
    const std::size_t samples = truth.distance_m.size();
    if (further.distance_m.size() != samples || further.velocity_mps.size() != samples) {
      throw bad_member(key, "has another number of samples than distance_m");
    }
    truth.more_targets.push_back(std::move(further));
  }
}

SceneTruth::Pixel read_pixel(const json& object, const std::string& key, std::size_t samples,
                             bool of_scan) {
  if (!object.is_object()) throw bad_member(key, "must be an object");
  SceneTruth::Pixel pixel;
  pixel.input = whole_number(object, "input");
  pixel.azimuth_deg = number(object, "azimuth_deg");
  pixel.elevation_deg = number(object, "elevation_deg");
  pixel.delay_ps = number(object, "delay_ps");
  pixel.signal_per_pulse = number(object, "signal_per_pulse");
  pixel.background_per_s = number(object, "background_per_s");
  pixel.distance_m = numbers(object, "distance_m");
  pixel.velocity_mps = numbers(object, "velocity_mps");
  if (pixel.distance_m.size() != samples || pixel.velocity_mps.size() != samples) {
    throw bad_member(key, "has another number of samples than distance_m");
  }
  if (of_scan) pixel.first_ps = whole_number(object, "first_ps");
  if (pixel.first_ps < 0) throw bad_member(key + "/first_ps", "is negative");
  return pixel;
}

void read_pixels(const json& object, SceneTruth& truth) {
  const auto found = object.find("pixels");
  if (found == object.end()) return;
  if (!found->is_array()) throw bad_member("pixels", "must be an array");
  if (object.contains("dwell_ps")) truth.dwell_ps = whole_number(object, "dwell_ps");
  for (const json& pixel : *found) {
    const std::string key = "pixels/" + std::to_string(truth.pixels.size());
    truth.pixels.push_back(read_pixel(pixel, key, truth.distance_m.size(), truth.dwell_ps > 0));
  }
  truth.crosstalk_probability = number(object, "crosstalk_probability");
  truth.crosstalk_ns = number(object, "crosstalk_ns");
}

void write_pixels(const SceneTruth& truth, nlohmann::ordered_json& object) {
  if (truth.pixels.empty()) return;
  object["crosstalk_probability"] = truth.crosstalk_probability;
  object["crosstalk_ns"] = truth.crosstalk_ns;
  if (truth.dwell_ps > 0) object["dwell_ps"] = truth.dwell_ps;
  for (const SceneTruth::Pixel& pixel : truth.pixels) {
    object["pixels"].push_back({{"input", pixel.input},
                                {"azimuth_deg", pixel.azimuth_deg},
                                {"elevation_deg", pixel.elevation_deg},
                                {"delay_ps", pixel.delay_ps},
                                {"signal_per_pulse", pixel.signal_per_pulse},
                                {"background_per_s", pixel.background_per_s},
                                {"distance_m", pixel.distance_m},
                                {"velocity_mps", pixel.velocity_mps}});
    if (truth.dwell_ps > 0) object["pixels"].back()["first_ps"] = pixel.first_ps;
  }
}

}  // namespace

std::string to_json(const SceneTruth& truth) {
  nlohmann::ordered_json object = {{"schema", "splid.truth"}, {"v", {1, 0}}};
  object["start_ps"] = std::to_string(truth.start_ps);
  object["step_ps"] = truth.step_ps;
  object["signal_per_pulse"] = truth.signal_per_pulse;
  object["background_per_s"] = truth.background_per_s;
  object["sigma_ps"] = truth.sigma_ps;
  if (truth.depth_m > 0) object["depth_m"] = truth.depth_m;
  object["electronic_delay_ns"] = truth.electronic_delay_ns;
  object["drift_ppm"] = truth.drift_ppm;
  object["drift_ramp_ppm_per_s"] = truth.drift_ramp_ppm_per_s;
  object["distance_m"] = truth.distance_m;
  object["velocity_mps"] = truth.velocity_mps;
  for (const SceneTruth::Further& target : truth.more_targets) {
    object["more_targets"].push_back({{"signal_per_pulse", target.signal_per_pulse},
                                      {"distance_m", target.distance_m},
                                      {"velocity_mps", target.velocity_mps}});
  }
  write_pixels(truth, object);
  return json_text(object);
}

SceneTruth truth_from_json(const std::string& text) {
  const json object = parse(text);
  check_schema(object);
  SceneTruth truth;
  truth.start_ps = whole_number_text(object, "start_ps");
  truth.step_ps = whole_number(object, "step_ps");
  truth.signal_per_pulse = number(object, "signal_per_pulse");
  truth.background_per_s = number(object, "background_per_s");
  truth.sigma_ps = number(object, "sigma_ps");
  if (object.contains("depth_m")) truth.depth_m = number(object, "depth_m");
  truth.electronic_delay_ns = number(object, "electronic_delay_ns");
  truth.drift_ppm = number(object, "drift_ppm");
  truth.drift_ramp_ppm_per_s = number(object, "drift_ramp_ppm_per_s");
  truth.distance_m = numbers(object, "distance_m");
  truth.velocity_mps = numbers(object, "velocity_mps");
  check_samples(truth);
  read_more_targets(object, truth);
  read_pixels(object, truth);
  return truth;
}

std::optional<SceneTruth::State> SceneTruth::at(std::int64_t time_ps) const {
  if (dwell_ps == 0) return between(time_ps, 0, distance_m, velocity_mps);
  for (const Pixel& pixel : pixels) {
    // Since the begin of the pixel's first dwell. Unsigned, as in between().
    const auto since_ps = static_cast<std::int64_t>(
        static_cast<std::uint64_t>(time_ps) - static_cast<std::uint64_t>(start_ps) -
        static_cast<std::uint64_t>(pixel.first_ps) + static_cast<std::uint64_t>(dwell_ps / 2));
    if (since_ps >= 0 && since_ps % step_ps < dwell_ps) return at(time_ps, pixel);
  }
  return std::nullopt;
}

std::optional<SceneTruth::State> SceneTruth::at(std::int64_t time_ps, const Pixel& pixel) const {
  return between(time_ps, pixel.first_ps, pixel.distance_m, pixel.velocity_mps);
}

std::optional<SceneTruth::State> SceneTruth::between(
    std::int64_t time_ps, std::int64_t first_ps, const std::vector<double>& distances_m,
    const std::vector<double>& velocities_mps) const {
  if (distances_m.empty() || time_ps < start_ps) return std::nullopt;
  // Unsigned: the difference of two times may pass the largest signed one.
  std::uint64_t since_ps =
      static_cast<std::uint64_t>(time_ps) - static_cast<std::uint64_t>(start_ps);
  if (since_ps < static_cast<std::uint64_t>(first_ps)) return std::nullopt;
  since_ps -= static_cast<std::uint64_t>(first_ps);
  const auto step = static_cast<std::uint64_t>(step_ps);
  const auto before = static_cast<std::size_t>(since_ps / step);
  const std::uint64_t rest_ps = since_ps % step;
  if (before >= distances_m.size()) return std::nullopt;
  if (rest_ps == 0) return State{distances_m[before], velocities_mps[before]};
  if (before + 1 == distances_m.size()) return std::nullopt;
  const double step_s = static_cast<double>(step_ps) * 1e-12;
  const double x = static_cast<double>(rest_ps) / static_cast<double>(step_ps);
  const double from_m = distances_m[before];
  const double to_m = distances_m[before + 1];
  const double from_slope_m = velocities_mps[before] * step_s;
  const double to_slope_m = velocities_mps[before + 1] * step_s;
  // Hermite's cubic is written as the straight line plus a correction, so that no digits are lost.
  const double line_m = to_m - from_m;
  const double bend = x * (1 - x);
  const double distance =
      from_m + x * line_m + bend * ((1 - x) * (from_slope_m - line_m) - x * (to_slope_m - line_m));
  const double velocity =
      velocities_mps[before] + x * (velocities_mps[before + 1] - velocities_mps[before]);
  return State{distance, velocity};
}

}  // namespace splid
