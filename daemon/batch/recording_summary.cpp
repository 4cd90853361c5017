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

// A text of a row, without the zeros that fill it up.
std::string_view text_at(std::string_view row, std::size_t offset, std::size_t bytes) {
  const std::string_view text = row.substr(offset, bytes);
  return text.substr(0, text.find('\0'));
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
    const std::string_view name = text_at(row, status, status_bytes);
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
  static const FrameColumn& column = summed_column("pixel");
  for (; !rows.empty(); rows.remove_prefix(frame_row_bytes())) {
    const std::string_view row = rows.substr(0, frame_row_bytes());
    of_pixel(text_at(row, column.offset, column.bytes)).take(row);
  }
}

RecordingSummary::OfPixel& RecordingSummary::of_pixel(std::string_view name) {
  const auto has_name = [name](const OfPixel& pixel) { return pixel.name == name; };
  if (next_ >= pixels_.size() || !has_name(pixels_[next_])) {
    const auto found = std::find_if(pixels_.begin(), pixels_.end(), has_name);
    next_ = static_cast<std::size_t>(found - pixels_.begin());
    if (found == pixels_.end()) pixels_.emplace_back().name = name;
  }
  OfPixel& pixel = pixels_[next_];
  next_ = (next_ + 1) % pixels_.size();
  return pixel;
}

void RecordingSummary::OfPixel::take(std::string_view row) {
  static const SummedColumns columns;
  last_s = SummedColumns::at<double>(row, columns.timestamp);
  if (frames++ == 0) first_s = last_s;
  ++of_status.at(columns.status_of(row));
  photons += SummedColumns::at<std::int64_t>(row, columns.photons);
  lost_tags += SummedColumns::at<std::int64_t>(row, columns.lost_tags);
  if (row[columns.valid] == 0) return;
  ++valid;
  const auto distance_m = SummedColumns::at<double>(row, columns.distance);
  const auto std_m = SummedColumns::at<double>(row, columns.std_distance);
  if (std::isfinite(distance_m)) distances_m.push_back(distance_m);
  if (std::isfinite(std_m)) stds_m.push_back(std_m);
}

std::string RecordingSummary::columns() {
  std::string names = "frames,valid";
  for (std::size_t i = 1; i < frame_status_names.size(); ++i) {
    names.append(",").append(frame_status_names.at(i));
  }
  return names +
         ",photons,lost_tags,first_timestamp,last_timestamp,least_distance_m,median_distance_m,"
         "largest_distance_m,median_std_distance_m,pixel";
}

std::string RecordingSummary::lines() const {
  if (pixels_.empty()) return OfPixel{}.line();
  std::string text;
  for (const OfPixel& pixel : pixels_) text += pixel.line();
  return text;
}

std::string RecordingSummary::OfPixel::line() const {
  std::string text = std::to_string(frames) + "," + std::to_string(valid);
  for (std::size_t i = 1; i < of_status.size(); ++i) {
    text.append(",").append(std::to_string(of_status.at(i)));
  }
  text.append(",").append(std::to_string(photons));
  text.append(",").append(std::to_string(lost_tags));
  text.append(",").append(frames > 0 ? number_text(first_s) : "");
  text.append(",").append(frames > 0 ? number_text(last_s) : "");
  const auto [least, largest] = std::minmax_element(distances_m.begin(), distances_m.end());
  text.append(",").append(distances_m.empty() ? "" : number_text(*least));
  text.append(",").append(median_text(distances_m));
  text.append(",").append(distances_m.empty() ? "" : number_text(*largest));
  return text.append(",").append(median_text(stds_m)).append(",").append(name).append("\n");
}

}  // namespace splid::batch
