#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>

#include "protocol/frame_json.hpp"

namespace splid::view {

// The last frames as lines of a table with the columns of every table of frames
// (protocol/frame_columns.hpp), for people who save what the page shows. Some 10 MB at most.
//
// Threads: one. Errors: none.
class FrameTable {
 public:
  // A quarter of an hour and more at 20 frames a second.
  static constexpr std::size_t most_frames = 20'000;

  // A frame more than a second before the last frame begins the table anew, as another replay does.
  void add(const FrameMessage& frame);

  // The frames from `from_s` to `to_s`, by their timestamps, below a line with the columns' names;
  // absent where frames of that time are no longer kept.
  [[nodiscard]] std::optional<std::string> csv(double from_s, double to_s) const;

 private:
  struct Row {
    double timestamp_s;
    std::string line;
  };
  std::deque<Row> rows_;
  bool is_cut_ = false;  // frames before the first row are gone
};

}  // namespace splid::view
