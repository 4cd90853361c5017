#include "protocol/status_json.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#include "protocol/json_writer.hpp"
#include "protocol/shown_text.hpp"

namespace splid {
namespace {

constexpr std::array<const char*, 5> daemon_state_names = {"starting", "waiting_for_device",
                                                           "streaming", "degraded", "stopping"};

constexpr std::array<const char*, 3> recording_state_names = {"waiting", "writing", "failing"};

void write_recording(JsonWriter& json, const RecordingStatus& recording) {
  JsonWriter members;
  members.text("state", to_string(recording.state));
  if (!recording.file.empty()) {
    members.text("file", recording.file)
        .integer("bytes", recording.bytes)
        .number("seconds", recording.seconds);
  }
  json.object("recording", members);
}

void write_names(JsonWriter& json, const char* name, const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& each : names) list += (list.empty() ? "" : ",") + json_string(each);
  if (!names.empty()) json.raw(name, "[" + list + "]");
}

void write_pixels(JsonWriter& json, const PixelsStatus& pixels) {
  JsonWriter members;
  members.integer("count", pixels.count);
  JsonWriter by_status;
  for (const auto& [status, count] : pixels.by_status) by_status.integer(status, count);
  members.object("by_status", by_status).integer("dark", pixels.dark).integer("hot", pixels.hot);
  write_names(members, "dark_names", pixels.dark_names);
  write_names(members, "hot_names", pixels.hot_names);
  json.object("pixels", members);
}

}  // namespace

const char* to_string(RecordingState state) {
  return recording_state_names.at(static_cast<std::size_t>(state));
}

const char* to_string(DaemonState state) {
  return daemon_state_names.at(static_cast<std::size_t>(state));
}

std::string headline(const std::string& state, const std::string& measurement) {
  const bool is_degraded = state == to_string(DaemonState::degraded);
  std::string words = state;
  if (is_degraded || state == to_string(DaemonState::streaming)) words = measurement;
  std::replace(words.begin(), words.end(), '_', ' ');
  return is_degraded && measurement == "ok" ? words + ", degraded" : words;
}

std::string to_json(const StatusMessage& message) {
  JsonWriter json = message_head("splid.status", message.timestamp_s, message.sequence);
  json.text("state", to_string(message.state))
      .text("measurement", message.measurement)
      .text("reason", shown_text(message.reason, most_said))
      .text("source", shown_text(message.source, most_said))
      .text("device", to_string(message.device));
  if (!message.device_name.empty())
    json.text("device_name", shown_text(message.device_name, most_said));
  json.integer("tags", message.tags).integer("lost_tags", message.lost_tags);
  write_uncounted_losses(json, message.uncounted_losses);
  json.integer("frames", message.frames)
      .integer("valid_frames", message.valid_frames)
      .number("ring_fill_ratio", message.ring_fill_ratio);
  if (!message.findings.empty()) json.raw("findings", to_json(message.findings));
  if (message.effort_is_lowered) json.flag("effort_is_lowered", true);
  if (message.pixels) write_pixels(json, *message.pixels);
  if (message.recording) write_recording(json, *message.recording);
  return json.finish();
}

std::string to_json(const VersionMessage& message) {
  return message_head("splid.version", message.timestamp_s, message.sequence)
      .text("release", message.release)
      .text("pattern", message.pattern)
      .text("mode", to_string(message.mode))
      .finish();
}

}  // namespace splid
