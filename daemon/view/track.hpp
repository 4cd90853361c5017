#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/base/clock.hpp"
#include "daemon/view/scene_past.hpp"
#include "daemon/view/view_history.hpp"
#include "protocol/frame_json.hpp"

namespace splid::view {

// A message as it came, the number of its arrival, 0: none came, and when it came.
struct LastMessage {
  std::string json;
  std::uint64_t number = 0;
  std::int64_t came_ns = 0;

  void put(std::string text, std::int64_t now_ns) {
    json = std::move(text);
    ++number;
    came_ns = now_ns;
  }
};

// What the page shows of one pixel: its last frames and the histories of its values. Some 3 MB at
// most.
//
// Threads: one. Errors: none.
class Track {
 public:
  // clock: outlives this.
  explicit Track(const Clock& clock);

  // json: the frame's message. ring_fill_ratio: of the last status.
  void take(const FrameMessage& frame, std::string json, double ring_fill_ratio);
  // Takes a pixel's frame as a scene has it, with fewer members than its own message, which comes
  // after the scene where it comes. So it counts when that message has not come before the next.
  void take_from_scene(FrameMessage frame, double ring_fill_ratio);
  // Takes all frames of a pixel before any other.
  void begin(const ScenePast& past, const std::string& pixel);

  // The index of the shortest history that has so many seconds, or of the longest.
  static std::size_t window_of(std::int64_t seconds);
  [[nodiscard]] const History& history(std::size_t window) const { return histories_.at(window); }
  [[nodiscard]] const History& last_minute() const;

  [[nodiscard]] const LastMessage& frame() const { return frame_; }
  // How old the last frame is, and the last valid one with it, as JSON for the page.
  [[nodiscard]] std::string past_json() const;

 private:
  void add(const FrameMessage& frame, std::string json, double ring_fill_ratio);
  [[nodiscard]] double age_s(const LastMessage& last) const;

  const Clock& clock_;
  std::vector<History> histories_;  // shortest first
  LastMessage frame_;
  LastMessage valid_;  // the last frame that is valid
  std::optional<FrameMessage> waiting_;
};

}  // namespace splid::view
