#include "protocol/scene_json.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "protocol/error.hpp"
#include "protocol/json_value.hpp"
#include "protocol/json_writer.hpp"
#include "protocol/text.hpp"

namespace splid {
namespace {

using Pixel = SceneMessage::Pixel;
using Value = std::optional<double> FrameMessage::*;
using Direction = std::optional<double> Pixel::*;

struct SceneValue {
  const char* name;
  Value value;
};

constexpr SceneValue scene_values[] = {{"distance_m", &FrameMessage::distance_m},
                                       {"velocity_mps", &FrameMessage::velocity_mps},
                                       {"signal_per_pulse", &FrameMessage::signal_per_pulse},
                                       {"background_per_s", &FrameMessage::background_per_s},
                                       {"significance", &FrameMessage::significance}};
constexpr SceneValue scene_deviations[] = {
    {"distance_m", &FrameMessage::std_distance_m},
    {"velocity_mps", &FrameMessage::std_velocity_mps},
    {"signal_per_pulse", &FrameMessage::std_signal_per_pulse},
    {"background_per_s", &FrameMessage::std_background_per_s}};

constexpr std::pair<const char*, Direction> directions[] = {
    {"azimuth_deg", &Pixel::azimuth_deg}, {"elevation_deg", &Pixel::elevation_deg}};

template <class Get>
void write_numbers(JsonWriter& out, const char* name, const std::vector<Pixel>& pixels,
                   const Get& get, bool may_be_left_out = false) {
  std::string list = "[";
  bool has_any = !may_be_left_out;
  for (const Pixel& pixel : pixels) {
    const std::optional<double> value = get(pixel);
    const bool is_known = value && std::isfinite(*value);
    has_any = has_any || is_known;
    if (list.size() > 1) list += ',';
    list += is_known ? number_text(*value) : "null";
  }
  if (has_any) out.raw(name, list + "]");
}

template <class Get>
void write_texts(JsonWriter& out, const char* name, const std::vector<Pixel>& pixels,
                 const Get& get) {
  std::string list = "[";
  for (const Pixel& pixel : pixels) {
    if (list.size() > 1) list += ',';
    list += json_string(get(pixel));
  }
  out.raw(name, list + "]");
}

void write_values(JsonWriter& out, std::span<const SceneValue> values,
                  const std::vector<Pixel>& pixels) {
  for (const auto& [name, value] : values) {
    write_numbers(out, name, pixels,
                  [member = value](const Pixel& pixel) { return pixel.frame.*member; });
  }
}

void write_shared(JsonWriter& out, const FrameMessage& whole) {
  out.text("start_ps", std::to_string(whole.start_ps)).number("duration_ms", whole.duration_ms);
  if (whole.lost_tags) out.integer("lost_tags", *whole.lost_tags);
  write_uncounted_losses(out, whole.uncounted_losses);
  out.number("seen_fraction", whole.seen_fraction);
  if (const auto& sync = whole.sync) {
    JsonWriter members;
    members.integer("count", sync->count)
        .integer("missing", sync->missing)
        .integer("spurious", sync->spurious)
        .number("period_ps", sync->period_ps)
        .number("drift_ppm", sync->drift_ppm)
        .number("jitter_ps", sync->jitter_ps);
    out.object("sync", members);
  }
}

[[noreturn]] void refuse_scene(const std::string& what) {
  throw Error(Fault::data, "scene message: " + what);
}

const nlohmann::json& needed(const nlohmann::json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end()) refuse_scene("/" + std::string(name) + " is missing");
  return *found;
}

double needed_number(const nlohmann::json& object, const char* name) {
  const nlohmann::json& value = needed(object, name);
  if (!value.is_number()) refuse_scene("/" + std::string(name) + " is not a number");
  return value.get<double>();
}

const nlohmann::json& needed_list(const nlohmann::json& object, const char* name,
                                  std::size_t size) {
  const nlohmann::json& list = needed(object, name);
  if (!list.is_array() || list.size() != size) {
    refuse_scene("/" + std::string(name) + " is not an array of " + std::to_string(size));
  }
  return list;
}

// set: takes a pixel and its value.
template <class Set>
void read_numbers(const nlohmann::json& object, const char* name, std::vector<Pixel>& pixels,
                  const Set& set) {
  if (!object.contains(name)) return;
  const nlohmann::json& list = needed_list(object, name, pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (list[i].is_null()) continue;
    if (!list[i].is_number()) {
      refuse_scene("/" + std::string(name) + "/" + std::to_string(i) + " is not a number");
    }
    set(pixels[i]) = list[i].get<double>();
  }
}

void read_values(const nlohmann::json& object, std::span<const SceneValue> values,
                 std::vector<Pixel>& pixels) {
  for (const auto& [name, value] : values) {
    read_numbers(
        object, name,
        pixels, [member = value](Pixel & pixel) -> auto& { return pixel.frame.*member; });
  }
}

void read_pixels(const nlohmann::json& object, std::vector<Pixel>& pixels) {
  const nlohmann::json& names = needed(object, "pixel");
  if (!names.is_array()) refuse_scene("/pixel is not an array");
  pixels.resize(names.size());
  const nlohmann::json& statuses = needed_list(object, "status", names.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const std::string place = "/" + std::to_string(i);
    if (!names[i].is_string()) refuse_scene("/pixel" + place + " is not a string");
    pixels[i].name = names[i].get<std::string>();
    const std::string status = statuses[i].is_string() ? statuses[i].get<std::string>() : "";
    const auto* found = std::find(frame_status_names.begin(), frame_status_names.end(), status);
    if (found == frame_status_names.end()) {
      refuse_scene(std::string("/status").append(place).append(" has the unknown value ") + status);
    }
    pixels[i].frame.status = static_cast<FrameStatus>(found - frame_status_names.begin());
  }
}

std::optional<double> number_if_any(const nlohmann::json& object, const char* name) {
  return object.contains(name) ? std::optional(needed_number(object, name)) : std::nullopt;
}

std::uint64_t needed_count(const nlohmann::json& object, const char* name) {
  const nlohmann::json& value = needed(object, name);
  if (!value.is_number_unsigned()) refuse_scene("/" + std::string(name) + " is not a count");
  return value.get<std::uint64_t>();
}

FrameMessage::Sync read_sync(const nlohmann::json& object) {
  if (!object.is_object()) refuse_scene("/sync is not an object");
  FrameMessage::Sync sync;
  sync.count = needed_count(object, "count");
  sync.missing = needed_count(object, "missing");
  sync.spurious = needed_count(object, "spurious");
  sync.period_ps = number_if_any(object, "period_ps");
  sync.drift_ppm = number_if_any(object, "drift_ppm");
  sync.jitter_ps = number_if_any(object, "jitter_ps");
  return sync;
}

void read_shared(const nlohmann::json& object, FrameMessage& whole) {
  whole.timestamp_s = needed_number(object, "timestamp");
  whole.sequence = needed_count(object, "sequence");
  const nlohmann::json& start = needed(object, "start_ps");
  const auto start_ps = start.is_string() ? whole_number(start.get<std::string>()) : std::nullopt;
  if (!start_ps) refuse_scene("/start_ps is not a whole number in a string");
  whole.start_ps = *start_ps;
  whole.duration_ms = needed_number(object, "duration_ms");
  if (object.contains("lost_tags")) whole.lost_tags = needed_count(object, "lost_tags");
  if (object.contains("uncounted_losses")) {
    whole.uncounted_losses = needed_count(object, "uncounted_losses");
  }
  whole.seen_fraction = number_if_any(object, "seen_fraction");
  if (object.contains("sync")) whole.sync = read_sync(object["sync"]);
  if (object.contains("effort") && object["effort"].is_string()) {
    whole.effort = object["effort"].get<std::string>();
  }
  whole.compute_ms = number_if_any(object, "compute_ms");
  whole.latency_ms = number_if_any(object, "latency_ms");
}

}  // namespace

std::string pixel_topic(const std::string& name) { return std::string(topic_frame) + "/" + name; }

std::string to_json(const SceneMessage& scene) {
  const FrameMessage& whole = scene.whole;
  JsonWriter json = message_head("splid.scene", whole.timestamp_s, whole.sequence);
  write_shared(json, whole);
  write_texts(json, "pixel", scene.pixels, [](const Pixel& pixel) { return pixel.name; });
  for (const auto& [name, direction] : directions) {
    write_numbers(
        json, name, scene.pixels,
        [member = direction](const Pixel& pixel) { return pixel.*member; }, true);
  }
  write_texts(json, "status", scene.pixels,
              [](const Pixel& pixel) { return to_string(pixel.frame.status); });
  write_values(json, scene_values, scene.pixels);
  JsonWriter deviations;
  write_values(deviations, scene_deviations, scene.pixels);
  json.object("std", deviations);
  if (whole.effort) json.text("effort", *whole.effort);
  json.number("compute_ms", whole.compute_ms).number("latency_ms", whole.latency_ms);
  return json.finish();
}

SceneMessage scene_from_json(const std::string& json) {
  const auto parsed = json_value_if_any(json);
  if (!parsed.is_object()) refuse_scene("not a JSON object");
  const nlohmann::json& schema = needed(parsed, "schema");
  if (schema != "splid.scene") refuse_scene("/schema is not splid.scene");
  const nlohmann::json& version = needed(parsed, "v");
  if (!version.is_array() || version.empty() || version.front() != 1) {
    refuse_scene("/v is not [1,minor]; this program reads version 1");
  }
  SceneMessage scene;
  read_shared(parsed, scene.whole);
  read_pixels(parsed, scene.pixels);
  for (const auto& [name, direction] : directions) {
    read_numbers(
        parsed, name,
        scene.pixels, [member = direction](Pixel & pixel) -> auto& { return pixel.*member; });
  }
  read_values(parsed, scene_values, scene.pixels);
  if (parsed.contains("std") && parsed["std"].is_object()) {
    read_values(parsed["std"], scene_deviations, scene.pixels);
  }
  return scene;
}

}  // namespace splid
