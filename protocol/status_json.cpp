#include "protocol/status_json.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#include "protocol/json_writer.hpp"
#include "protocol/member_writer.hpp"
#include "protocol/status_members.hpp"

namespace splid {
namespace {

constexpr std::array<const char*, 5> daemon_state_names = {"starting", "waiting_for_device",
                                                           "streaming", "degraded", "stopping"};

constexpr std::array<const char*, 3> recording_state_names = {"waiting", "writing", "failing"};

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
  MemberWriter writer(json);
  describe(message, writer);
  return json.finish();
}

std::string to_json(const VersionMessage& message) {
  JsonWriter json = message_head("splid.version", message.timestamp_s, message.sequence);
  MemberWriter writer(json);
  describe(message, writer);
  return json.finish();
}

}  // namespace splid
