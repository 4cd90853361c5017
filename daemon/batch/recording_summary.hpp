#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/frame_status.hpp"

namespace splid::batch {

// What all frames of a recording came to: its line of the summary, made of the rows of its table.
//
// Threads: one. Errors: none.
class RecordingSummary {
 public:
  // Takes some rows, as append_frame_row() writes them.
  void take(std::string_view rows);

  [[nodiscard]] std::uint64_t frames() const { return frames_; }
  // The values of the columns of columns(), with commas between them; a value that no frame has is
  // left out.
  [[nodiscard]] std::string line() const;
  // frames, how many of them are valid and have each status, photons, lost tags, the times of the
  // first and the last frame (UTC, s), the least, median and largest distance of the valid frames
  // (m), and the median of its standard deviation (m).
  static std::string columns();

 private:
  std::uint64_t frames_ = 0;
  std::uint64_t valid_ = 0;
  std::array<std::uint64_t, frame_status_names.size()> of_status_{};
  std::int64_t photons_ = 0;
  std::int64_t lost_tags_ = 0;
  double first_s_ = 0;
  double last_s_ = 0;
  std::vector<double> distances_m_;
  std::vector<double> stds_m_;
};

}  // namespace splid::batch
