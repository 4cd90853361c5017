#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/simulator/scanner_options.hpp"
#include "protocol/scan_lines.hpp"

namespace splid::simulator {

// Where a scanner looks at a time of the stream, and the markers that say so. A picture follows the
// other for ever.
//
// Threads: one. Errors: none. No allocation.
class Scanner {
 public:
  struct Marker {
    std::int64_t time_ps = 0;
    int bits = 0;
  };

  // options: used and valid. columns, rows: of the array, at least 1.
  Scanner(const ScannerOptions& options, std::int64_t columns, std::int64_t rows);

  // The pixel, row * columns + column of the picture. Absent before the first line and between two
  // lines. time_ps: since the stream's start.
  [[nodiscard]] std::optional<std::size_t> pixel_at(std::int64_t time_ps) const;

  // How a program cuts the scan into its dwells.
  [[nodiscard]] ScanLines lines() const;
  [[nodiscard]] std::int64_t dwell_ps() const { return dwell_ps_; }
  // From one picture's start to the next one's.
  [[nodiscard]] std::int64_t picture_ps() const { return rows_ * line_ps_; }
  // The middle of the pixel's first dwell whose middle is in the stream.
  [[nodiscard]] std::int64_t first_middle_ps(std::size_t pixel) const;

  // The first marker that was not taken. Of a stop and a start at one time the stop is the first.
  [[nodiscard]] const Marker& next_marker() const { return marker_; }
  void take_marker();

 private:
  [[nodiscard]] int line_start_bits(std::int64_t line) const;
  // The place in its line of a pixel's dwell, and back.
  [[nodiscard]] std::int64_t turned(std::int64_t row, std::int64_t column) const;

  std::int64_t columns_;
  std::int64_t rows_;
  std::int64_t dwell_ps_;
  std::int64_t line_ps_;  // from a line's start to the next line's start
  std::int64_t start_ps_;
  bool both_ways_;
  int start_bits_;
  int stop_bits_;
  int frame_bits_;
  std::int64_t line_ = 0;  // of the next marker
  Marker marker_;
};

}  // namespace splid::simulator
