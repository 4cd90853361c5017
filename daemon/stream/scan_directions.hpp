#pragma once

#include <optional>
#include <vector>

#include "config/scan_options.hpp"
#include "daemon/stream/frame.hpp"

namespace splid {

// Where a scanner looks; absent: not known.
struct ScanDirection {
  std::optional<double> azimuth_deg;    // to the right
  std::optional<double> elevation_deg;  // up
};

// Finds the direction of a scan's dwells: by a scale from the first to the last pixel and line, or
// from the angles that the scanner's encoders read, by the ticks of their sample clock.
//
// Threads: any; it is constant. Errors: Error(Fault::usage) from the constructor, naming the file
// and the line, where the file of angles cannot be read.
class ScanDirections {
 public:
  explicit ScanDirections(const ScanOptions& options);

  // Of the middle of the dwell; between two ticks by interpolation. Absent where the file has no
  // row for it.
  [[nodiscard]] ScanDirection of(const ScanPlace& place) const;

 private:
  struct Angles {
    double azimuth_deg, elevation_deg;
  };

  ScanOptions options_;
  std::vector<Angles> rows_;  // by tick
};

}  // namespace splid
