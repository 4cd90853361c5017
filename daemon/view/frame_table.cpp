#include "daemon/view/frame_table.hpp"

#include "protocol/frame_columns.hpp"

namespace splid::view {

void FrameTable::add(const FrameMessage& frame) {
  if (!rows_.empty() && frame.timestamp_s < rows_.back().timestamp_s - 1) {
    rows_.clear();
    is_cut_ = false;
  }
  rows_.push_back({frame.timestamp_s, frame_csv_row(frame)});
  if (rows_.size() <= most_frames) return;
  rows_.pop_front();
  is_cut_ = true;
}

std::optional<std::string> FrameTable::csv(double from_s, double to_s) const {
  if (is_cut_ && !(from_s >= rows_.front().timestamp_s)) return std::nullopt;
  std::string text = frame_csv_head();
  for (const Row& row : rows_) {
    if (row.timestamp_s >= from_s && row.timestamp_s <= to_s) text += row.line;
  }
  return text;
}

}  // namespace splid::view
