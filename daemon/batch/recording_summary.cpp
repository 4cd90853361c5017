#include "daemon/batch/recording_summary.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "protocol/frame_columns.hpp"
#include "protocol/json_writer.hpp"

namespace splid::batch {
namespace {

const FrameColumn& summed_column(std::string_view name) {
  const auto& all = frame_columns();
  return *std::find_if(all.begin(), all.end(),
                       [name](const FrameColumn& column) { return column.name == name; });
}

// Reads the values that the summary is made of from a row.
struct SummedColumns {
  std::size_t timestamp = summed_column("timestamp").offset;
  std::size_t status = summed_column("status").offset;
  std::size_t status_bytes = summed_column("status").bytes;
  std::size_t valid = summed_column("valid").offset;
  std::size_t distance = summed_column("distance_m").offset;
  std::size_t std_distance = summed_column("std_distance_m").offset;
  std::size_t photons = summed_column("photons").offset;
  std::size_t lost_tags = summed_column("lost_tags").offset;

  template <class Value>
  static Value at(std::string_view row, std::size_t offset) {
    Value value;
    std::memcpy(&value, row.data() + offset, sizeof value);
    return value;
  }
  [[nodiscard]] std::size_t status_of(std::string_view row) const {
    const std::string_view text = row.substr(status, status_bytes);
    const std::string_view name = text.substr(0, text.find('\0'));
    const auto* const found = std::find(frame_status_names.begin(), frame_status_names.end(), name);
    return static_cast<std::size_t>(found - frame_status_names.begin()) % frame_status_names.size();
  }
};

// Empty where there are no values.
std::string median_text(std::vector<double> values) {
  if (values.empty()) return {};
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return number_text(*middle);
}

}  // namespace

void RecordingSummary::take(std::string_view rows) {
  static const SummedColumns columns;
  for (; !rows.empty(); rows.remove_prefix(frame_row_bytes())) {
    const std::string_view row = rows.substr(0, frame_row_bytes());
    last_s_ = SummedColumns::at<double>(row, columns.timestamp);
    if (frames_++ == 0) first_s_ = last_s_;
    ++of_status_.at(columns.status_of(row));
    photons_ += SummedColumns::at<std::int64_t>(row, columns.photons);
    lost_tags_ += SummedColumns::at<std::int64_t>(row, columns.lost_tags);
    if (row[columns.valid] == 0) continue;
    ++valid_;
    const auto distance_m = SummedColumns::at<double>(row, columns.distance);
    const auto std_m = SummedColumns::at<double>(row, columns.std_distance);
    if (std::isfinite(distance_m)) distances_m_.push_back(distance_m);
    if (std::isfinite(std_m)) stds_m_.push_back(std_m);
  }
}

std::string RecordingSummary::columns() {
  std::string names = "frames,valid";
  for (std::size_t i = 1; i < frame_status_names.size(); ++i) {
    names.append(",").append(frame_status_names.at(i));
  }
  return names +
         ",photons,lost_tags,first_timestamp,last_timestamp,least_distance_m,median_distance_m,"
         "largest_distance_m,median_std_distance_m";
}

std::string RecordingSummary::line() const {
  std::string text = std::to_string(frames_) + "," + std::to_string(valid_);
  for (std::size_t i = 1; i < of_status_.size(); ++i) {
    text.append(",").append(std::to_string(of_status_.at(i)));
  }
  text.append(",").append(std::to_string(photons_));
  text.append(",").append(std::to_string(lost_tags_));
  text.append(",").append(frames_ > 0 ? number_text(first_s_) : "");
  text.append(",").append(frames_ > 0 ? number_text(last_s_) : "");
  const auto [least, largest] = std::minmax_element(distances_m_.begin(), distances_m_.end());
  text.append(",").append(distances_m_.empty() ? "" : number_text(*least));
  text.append(",").append(median_text(distances_m_));
  text.append(",").append(distances_m_.empty() ? "" : number_text(*largest));
  return text.append(",").append(median_text(stds_m_));
}

}  // namespace splid::batch
