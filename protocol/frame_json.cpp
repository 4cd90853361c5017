#include "protocol/frame_json.hpp"

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string_view>

#include "protocol/error.hpp"
#include "protocol/json_value.hpp"
#include "protocol/json_writer.hpp"
#include "protocol/text.hpp"

namespace splid {
namespace {

void write_estimates(JsonWriter& json, const FrameMessage& message) {
  json.number("distance_m", message.distance_m)
      .number("velocity_mps", message.velocity_mps)
      .number("acceleration_mps2", message.acceleration_mps2)
      .number("signal_per_pulse", message.signal_per_pulse)
      .number("background_per_s", message.background_per_s)
      .number("signal_per_period", message.signal_per_period)
      .number("background_per_period", message.background_per_period)
      .number("sbr", message.sbr)
      .number("delay_ns", message.delay_ns)
      .number("significance", message.significance)
      .number("range_odds_nats", message.range_odds_nats)
      .number("amplitude_misfit", message.amplitude_misfit)
      .number("pulse_misfit", message.pulse_misfit)
      .number("pulse_excess", message.pulse_excess)
      .number("acceleration_misfit_mps2", message.acceleration_misfit_mps2)
      .number("jerk_misfit_mps3", message.jerk_misfit_mps3)
      .number("path_excess", message.path_excess)
      .number("signal_gap", message.signal_gap)
      .number("pulse_sigma_ps", message.pulse_sigma_ps)
      .number("shape_misfit", message.shape_misfit)
      .number("pulse_skew", message.pulse_skew)
      .number("blind_fraction", message.blind_fraction)
      .number("dead_time_misfit_ns", message.dead_time_misfit_ns)
      .number("afterpulse_misfit", message.afterpulse_misfit)
      .number("flicker_misfit", message.flicker_misfit);
  if (message.pattern_fault) json.text("pattern_fault", to_string(*message.pattern_fault));
  JsonWriter std_members;
  std_members.number("distance_m", message.std_distance_m)
      .number("velocity_mps", message.std_velocity_mps)
      .number("acceleration_mps2", message.std_acceleration_mps2)
      .number("signal_per_pulse", message.std_signal_per_pulse)
      .number("background_per_s", message.std_background_per_s)
      .number("pulse_excess", message.std_pulse_excess)
      .number("pulse_sigma_ps", message.std_pulse_sigma_ps)
      .number("pulse_skew", message.std_pulse_skew);
  json.object("std", std_members);
}

void write_targets(JsonWriter& json, const FrameMessage& message) {
  if (!message.targets) return;
  std::string list;
  for (const FrameMessage::Target& target : *message.targets) {
    JsonWriter one;
    one.text("status", to_string(target.status))
        .number("distance_m", target.distance_m)
        .number("velocity_mps", target.velocity_mps)
        .number("signal_per_pulse", target.signal_per_pulse)
        .number("signal_per_period", target.signal_per_period)
        .number("delay_ns", target.delay_ns)
        .number("significance", target.significance)
        .number("range_odds_nats", target.range_odds_nats)
        .number("amplitude_misfit", target.amplitude_misfit)
        .number("pulse_misfit", target.pulse_misfit)
        .number("acceleration_misfit_mps2", target.acceleration_misfit_mps2)
        .number("jerk_misfit_mps3", target.jerk_misfit_mps3)
        .number("signal_gap", target.signal_gap)
        .number("shape_odds_nats", target.shape_odds_nats);
    JsonWriter std_members;
    std_members.number("distance_m", target.std_distance_m)
        .number("velocity_mps", target.std_velocity_mps)
        .number("signal_per_pulse", target.std_signal_per_pulse);
    one.object("std", std_members);
    if (!list.empty()) list += ',';
    list += one.finish();
  }
  json.raw("targets", "[" + list + "]");
}

void write_sync(JsonWriter& json, const FrameMessage& message) {
  if (!message.sync) return;
  JsonWriter sync;
  sync.integer("count", message.sync->count)
      .integer("missing", message.sync->missing)
      .integer("spurious", message.sync->spurious)
      .number("period_ps", message.sync->period_ps)
      .number("drift_ppm", message.sync->drift_ppm)
      .number("jitter_ps", message.sync->jitter_ps);
  json.object("sync", sync);
}

void write_reference(JsonWriter& json, const FrameMessage& message) {
  if (!message.reference) return;
  JsonWriter reference;
  reference.number("distance_m", message.reference->distance_m)
      .number("velocity_mps", message.reference->velocity_mps);
  json.object("reference", reference);
}

// Reads the members of an object of a message. where: the object's JSON pointer.
class Members {
 public:
  Members(const nlohmann::json& json, std::string where) : json_(json), where_(std::move(where)) {
    if (!json.is_object()) fail("", "is not an object");
  }

  [[nodiscard]] const nlohmann::json* find(const char* key) const {
    const auto found = json_.find(key);
    return found == json_.end() ? nullptr : &*found;
  }
  [[nodiscard]] std::optional<double> number(const char* key) const {
    const nlohmann::json* value = find(key);
    if (value == nullptr) return std::nullopt;
    if (!value->is_number()) fail(key, "is not a number");
    return value->get<double>();
  }
  [[nodiscard]] std::optional<std::uint64_t> count(const char* key) const {
    const nlohmann::json* value = find(key);
    if (value == nullptr) return std::nullopt;
    if (!value->is_number_unsigned()) fail(key, "is not a count");
    return value->get<std::uint64_t>();
  }
  [[nodiscard]] std::optional<std::string> text(const char* key) const {
    const nlohmann::json* value = find(key);
    if (value == nullptr) return std::nullopt;
    if (!value->is_string()) fail(key, "is not a string");
    return value->get<std::string>();
  }
  template <class Value>
  [[nodiscard]] Value required(const char* key, const std::optional<Value>& value) const {
    if (!value) fail(key, "is missing");
    return *value;
  }
  [[noreturn]] void fail(const std::string& key, const std::string& what) const {
    throw Error(Fault::data, "frame message: " + where_ + "/" + key + " " + what);
  }

 private:
  const nlohmann::json& json_;
  std::string where_;
};

FrameStatus frame_status(const Members& members) {
  const std::string name = members.required("status", members.text("status"));
  for (std::size_t i = 0; i < frame_status_names.size(); ++i) {
    if (name == frame_status_names.at(i)) return static_cast<FrameStatus>(i);
  }
  members.fail("status", "has the unknown value " + name);
}

Mode frame_mode(const Members& members) {
  const std::string name = members.required("mode", members.text("mode"));
  const auto mode = mode_from_string(name);
  if (!mode) members.fail("mode", "has the unknown value " + name);
  return *mode;
}

void check_schema(const Members& members) {
  const std::string schema = members.required("schema", members.text("schema"));
  if (schema != "splid.frame") members.fail("schema", "is " + schema + ", not splid.frame");
  const nlohmann::json* version = members.find("v");
  if (version == nullptr) members.fail("v", "is missing");
  if (!version->is_array() || version->empty() || version->front() != 1) {
    members.fail("v", "is not [1,minor]; this program reads version 1");
  }
}

void read_always_present(const Members& members, FrameMessage& message) {
  message.timestamp_s = members.required("timestamp", members.number("timestamp"));
  message.sequence = members.required("sequence", members.count("sequence"));
  message.status = frame_status(members);
  message.mode = frame_mode(members);
  const auto start_ps = whole_number(members.required("start_ps", members.text("start_ps")));
  message.start_ps = members.required("start_ps", start_ps);
  message.duration_ms = members.required("duration_ms", members.number("duration_ms"));
}

std::optional<PatternFault> pattern_fault(const Members& members) {
  const auto name = members.text("pattern_fault");
  if (!name) return std::nullopt;
  for (std::size_t i = 0; i < pattern_fault_names.size(); ++i) {
    if (*name == pattern_fault_names.at(i)) return static_cast<PatternFault>(i);
  }
  members.fail("pattern_fault", "is " + *name + ", which is no fault of a pattern");
}

void read_estimates(const Members& members, FrameMessage& message) {
  message.distance_m = members.number("distance_m");
  message.velocity_mps = members.number("velocity_mps");
  message.acceleration_mps2 = members.number("acceleration_mps2");
  message.signal_per_pulse = members.number("signal_per_pulse");
  message.background_per_s = members.number("background_per_s");
  message.signal_per_period = members.number("signal_per_period");
  message.background_per_period = members.number("background_per_period");
  message.sbr = members.number("sbr");
  message.delay_ns = members.number("delay_ns");
  message.significance = members.number("significance");
  message.range_odds_nats = members.number("range_odds_nats");
  message.amplitude_misfit = members.number("amplitude_misfit");
  message.pulse_misfit = members.number("pulse_misfit");
  message.pulse_excess = members.number("pulse_excess");
  message.acceleration_misfit_mps2 = members.number("acceleration_misfit_mps2");
  message.jerk_misfit_mps3 = members.number("jerk_misfit_mps3");
  message.path_excess = members.number("path_excess");
  message.signal_gap = members.number("signal_gap");
  message.pulse_sigma_ps = members.number("pulse_sigma_ps");
  message.shape_misfit = members.number("shape_misfit");
  message.pulse_skew = members.number("pulse_skew");
  message.blind_fraction = members.number("blind_fraction");
  message.dead_time_misfit_ns = members.number("dead_time_misfit_ns");
  message.afterpulse_misfit = members.number("afterpulse_misfit");
  message.flicker_misfit = members.number("flicker_misfit");
  message.pattern_fault = pattern_fault(members);
  if (const nlohmann::json* json = members.find("std")) {
    const Members std_members(*json, "/std");
    message.std_distance_m = std_members.number("distance_m");
    message.std_velocity_mps = std_members.number("velocity_mps");
    message.std_acceleration_mps2 = std_members.number("acceleration_mps2");
    message.std_signal_per_pulse = std_members.number("signal_per_pulse");
    message.std_background_per_s = std_members.number("background_per_s");
    message.std_pulse_excess = std_members.number("pulse_excess");
    message.std_pulse_sigma_ps = std_members.number("pulse_sigma_ps");
    message.std_pulse_skew = std_members.number("pulse_skew");
  }
}

FrameMessage::Target target_from(const Members& members, const std::string& where) {
  FrameMessage::Target target;
  target.status = frame_status(members);
  target.distance_m = members.number("distance_m");
  target.velocity_mps = members.number("velocity_mps");
  target.signal_per_pulse = members.number("signal_per_pulse");
  target.signal_per_period = members.number("signal_per_period");
  target.delay_ns = members.number("delay_ns");
  target.significance = members.number("significance");
  target.range_odds_nats = members.number("range_odds_nats");
  target.amplitude_misfit = members.number("amplitude_misfit");
  target.pulse_misfit = members.number("pulse_misfit");
  target.acceleration_misfit_mps2 = members.number("acceleration_misfit_mps2");
  target.jerk_misfit_mps3 = members.number("jerk_misfit_mps3");
  target.signal_gap = members.number("signal_gap");
  target.shape_odds_nats = members.number("shape_odds_nats");
  if (const nlohmann::json* json = members.find("std")) {
    const Members std_members(*json, where + "/std");
    target.std_distance_m = std_members.number("distance_m");
    target.std_velocity_mps = std_members.number("velocity_mps");
    target.std_signal_per_pulse = std_members.number("signal_per_pulse");
  }
  return target;
}

void read_targets(const Members& members, FrameMessage& message) {
  const nlohmann::json* list = members.find("targets");
  if (list == nullptr) return;
  if (!list->is_array()) members.fail("targets", "is not an array");
  message.targets.emplace();
  for (const nlohmann::json& json : *list) {
    const std::string where = "/targets/" + std::to_string(message.targets->size());
    message.targets->push_back(target_from({json, where}, where));
  }
}

FrameMessage::Sync sync_from(const Members& members) {
  FrameMessage::Sync sync;
  sync.count = members.required("count", members.count("count"));
  sync.missing = members.required("missing", members.count("missing"));
  sync.spurious = members.required("spurious", members.count("spurious"));
  sync.period_ps = members.number("period_ps");
  sync.drift_ppm = members.number("drift_ppm");
  sync.jitter_ps = members.number("jitter_ps");
  return sync;
}

FrameMessage::Reference reference_from(const Members& members) {
  return {members.number("distance_m"), members.number("velocity_mps")};
}

void read_circumstances(const Members& members, FrameMessage& message) {
  message.photons = members.count("photons");
  message.lost_tags = members.count("lost_tags");
  message.uncounted_losses = members.count("uncounted_losses").value_or(0);
  message.seen_fraction = members.number("seen_fraction");
  if (const auto* json = members.find("sync")) message.sync = sync_from({*json, "/sync"});
  if (const auto* json = members.find("reference")) {
    message.reference = reference_from({*json, "/reference"});
  }
  message.effort = members.text("effort");
  message.compute_ms = members.number("compute_ms");
  message.latency_ms = members.number("latency_ms");
}

}  // namespace

std::string to_json(const FrameMessage& message) {
  JsonWriter json = message_head("splid.frame", message.timestamp_s, message.sequence);
  json.text("status", to_string(message.status))
      .flag("valid", message.valid())
      .text("mode", to_string(message.mode))
      .text("start_ps", std::to_string(message.start_ps))
      .number("duration_ms", message.duration_ms);
  write_estimates(json, message);
  write_targets(json, message);
  if (message.photons) json.integer("photons", *message.photons);
  if (message.lost_tags) json.integer("lost_tags", *message.lost_tags);
  write_uncounted_losses(json, message.uncounted_losses);
  json.number("seen_fraction", message.seen_fraction);
  write_sync(json, message);
  write_reference(json, message);
  if (message.effort) json.text("effort", *message.effort);
  json.number("compute_ms", message.compute_ms).number("latency_ms", message.latency_ms);
  return json.finish();
}

FrameMessage frame_from_json(const std::string& json) {
  const auto parsed = json_value_if_any(json);
  if (parsed.is_discarded()) throw Error(Fault::data, "frame message: not JSON");
  const Members members(parsed, "");
  check_schema(members);
  FrameMessage message;
  read_always_present(members, message);
  read_estimates(members, message);
  read_targets(members, message);
  read_circumstances(members, message);
  return message;
}

}  // namespace splid
