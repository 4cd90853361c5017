#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "protocol/device_report.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/pattern.hpp"

// The `status` and `version` messages: how the daemon and its instrument are, and which program and
// pattern run, with their JSON (docs/reference/messages.md). protocol/frame_json.hpp has the frame.

namespace splid {

enum class DaemonState { starting, waiting_for_device, streaming, degraded, stopping };

const char* to_string(DaemonState state);

// How it stands with the recording that the daemon keeps beside its measurement: no tag has come
// for it yet, its tags go into a file, or nothing is recorded although it should be.
enum class RecordingState { waiting, writing, failing };

const char* to_string(RecordingState state);

struct RecordingStatus {
  RecordingState state = RecordingState::waiting;
  std::string file = {};    // begun last; empty: none yet
  std::uint64_t bytes = 0;  // of that file
  double seconds = 0;       // from that file's first tag to its last, by the tagger's clock
  friend bool operator==(const RecordingStatus&, const RecordingStatus&) = default;
};

// What several pixels do.
struct PixelsStatus {
  static constexpr std::size_t most_named = 16;
  std::size_t count = 0;
  std::map<std::string, std::size_t> by_status;  // of the last frame: `ok`, `no_target`, ...
  // In the last second that is over: those that counted nothing, and those that counted more than
  // there is room for or many times as much as the others. Names of most_named at most.
  std::size_t dark = 0, hot = 0;
  std::vector<std::string> dark_names, hot_names;
};

// The `status` message: once a second and on every change.
struct StatusMessage {
  double timestamp_s = 0;
  std::uint64_t sequence = 0;
  DaemonState state = DaemonState::starting;
  std::string reason;  // one sentence; empty where there is nothing to say
  std::string source;  // driver's name
  DeviceState device = DeviceState::connected;
  std::uint64_t tags = 0;       // events taken from the source
  std::uint64_t lost_tags = 0;  // known count
  std::uint64_t frames = 0;     // published
  std::uint64_t valid_frames = 0;
  double ring_fill_ratio = 0;  // 0 to 1, highest since the last status
  // Which instrument is read, in its driver's words for it; where empty, the member is left out.
  std::string device_name = {};
  std::uint64_t uncounted_losses = 0;  // losses that took an unknown number of tags
  // The last frame had less effort than was configured; where false, the member is left out.
  bool effort_is_lowered = false;
  std::optional<RecordingStatus> recording = {};  // absent: nothing is to be recorded
  // What comes of the stream: `ok`, what keeps most frames of the last second from being ok, or
  // `none`; see daemon/output/last_second.hpp.
  std::string measurement = "none";
  std::vector<FrameMessage::Finding> findings = {};  // that stand out, the surest first
  using Pixels = PixelsStatus;
  std::optional<Pixels> pixels = {};  // where there are several
};

// The `version` message: what a new subscriber gets first.
struct VersionMessage {
  double timestamp_s = 0;
  std::uint64_t sequence = 0;
  std::string release;  // of the program
  std::string pattern;  // name of the pattern in use: its file's stem
  Mode mode = Mode::baseline;
};

// What people see first, of a status's two members: the measurement while frames come out, with
// "degraded" beside it where nothing else says that something is wrong, and otherwise the state.
// "ok", "no target", "ok, degraded", "waiting for device".
std::string headline(const std::string& state, const std::string& measurement);

inline constexpr const char* topic_status = "status";
inline constexpr const char* topic_version = "version";

// One line of JSON without a line feed, numbers as in a frame's.
std::string to_json(const StatusMessage& message);
std::string to_json(const VersionMessage& message);

}  // namespace splid
