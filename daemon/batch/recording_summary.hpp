#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/frame_status.hpp"

namespace splid::batch {

// What all frames of a recording came to: its lines of the summary, made of the rows of its table.
// There is one line; of several pixels one for each, in the order of the rows.
//
// Threads: one. Errors: none.
class RecordingSummary {
 public:
  // Takes some rows, as append_frame_row() writes them.
  void take(std::string_view rows);

  // The values of the columns of columns(), with commas between them and a line feed behind; a
  // value that no frame has is left out.
  [[nodiscard]] std::string lines() const;
  // frames, how many of them are valid and have each status, photons, lost tags, the times of the
  // first and the last frame (UTC, s), the least, median and largest distance of the valid frames
  // (m), the median of its standard deviation (m), and the pixel's name where there are several.
  static std::string columns();

 private:
  struct OfPixel {
    std::string name;  // empty: there is one pixel
    std::uint64_t frames = 0;
    std::uint64_t valid = 0;
    std::array<std::uint64_t, frame_status_names.size()> of_status{};
    std::int64_t photons = 0;
    std::int64_t lost_tags = 0;
    double first_s = 0;
    double last_s = 0;
    std::vector<double> distances_m;
    std::vector<double> stds_m;

    void take(std::string_view row);
    [[nodiscard]] std::string line() const;
  };
  OfPixel& of_pixel(std::string_view name);

  std::vector<OfPixel> pixels_;
  std::size_t next_ = 0;  // the pixel that the next row is of where pixels come in turn
};

}  // namespace splid::batch
