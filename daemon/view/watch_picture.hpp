#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/view/sparkline.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/scene_json.hpp"

namespace splid::view {

// What a picture shows of a `status` message; empty and 0 where the message has no such member.
struct WatchedStatus {
  std::string state, measurement, reason, device, device_name;
  std::vector<FrameMessage::Finding> findings;
  std::uint64_t lost_tags = 0, uncounted_losses = 0, frames = 0, valid_frames = 0;
  double ring_fill_ratio = 0;
  std::string recording_state, recording_file;
  std::uint64_t recording_bytes = 0;
  double recording_seconds = 0;
};

// The picture of `splid listen --watch`, made of what the daemon publishes: its state, the pictures
// of the last scene, the values of the last frame with their deviations, sparklines of the last
// seconds, and the ring's fill. A daemon of several pixels has no values of one before their topic
// is watched.
//
// Threads: one. Errors: none.
class WatchPicture {
 public:
  // endpoint: which daemon is watched, for the first line. values: the topic whose frames are
  // shown, `frame` or that of a pixel.
  WatchPicture(std::string endpoint, Characters characters, std::string values = topic_frame);

  // Takes one message of the topics frame, frame/NAME, scene, status and version. Counts those that
  // cannot be read.
  void take(const std::string& topic, const std::string& json);

  // The daemon cannot be reached, in words; empty: it can. The values shown are then old, and the
  // picture says so.
  void set_connection(const std::string& trouble) { trouble_ = trouble; }

  struct Size {
    std::size_t columns = 80, rows = 24;
  };
  // At most `rows` lines of at most `columns` characters each, what matters most first. colour:
  // with the terminal's codes for colours, which take no column.
  [[nodiscard]] std::vector<std::string> lines(Size size, bool colour) const;

 private:
  void take_status(const std::string& json);
  void take_version(const std::string& json);
  void take_frame(const std::string& json);
  void take_scene(const std::string& json);
  void add_head(std::vector<std::string>& to, std::size_t columns, bool colour) const;
  void add_field(std::vector<std::string>& to, std::size_t columns) const;
  void add_values(std::vector<std::string>& to, std::size_t columns, bool colour) const;
  void add_further_targets(std::vector<std::string>& to) const;
  void add_sparklines(std::vector<std::string>& to, std::size_t columns) const;
  [[nodiscard]] std::string ring_bar(std::size_t columns) const;
  [[nodiscard]] std::string counts() const;
  [[nodiscard]] std::string recording() const;

  std::string endpoint_;
  Characters characters_;
  std::string values_;
  std::string trouble_;
  std::optional<WatchedStatus> status_;
  std::string release_, pattern_;
  std::optional<FrameMessage> frame_;
  std::optional<SceneMessage> scene_;
  std::uint64_t unread_ = 0;  // messages of frames and scenes
  Sparkline distance_, velocity_, signal_;
};

// The characters that the terminal of this process shows, by the locale in its environment.
Characters terminal_characters();

}  // namespace splid::view
