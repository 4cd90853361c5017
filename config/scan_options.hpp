#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/daemon_options.hpp"
#include "protocol/options.hpp"
#include "protocol/scan_lines.hpp"

namespace splid {

// What a scanner does, beyond `frame.by`: where its pictures begin, and where it looks. JSON:
// `scan`.
struct ScanOptions {
  std::string picture;                // `marker:N` at the begin of a picture; empty: none
  std::int64_t lines = 0;             // of a picture; 0: not known
  bool both_ways = false;             // every second line runs back
  double sine_percent = 0;            // as in ScanLines
  std::vector<double> azimuth_deg;    // of a line's first and last pixel; empty: not known
  std::vector<double> elevation_deg;  // of a picture's first and last line; empty: not known
  std::string angles;                 // file of both, a row for each tick of the encoder; or empty

  // Whether it tells a direction of a dwell.
  [[nodiscard]] bool has_directions() const {
    return !azimuth_deg.empty() || !elevation_deg.empty() || !angles.empty();
  }
  void describe(OptionVisitor& visitor);
  [[nodiscard]] std::optional<OptionFault> validate(const ChannelOptions& channels) const;
};

// What is wrong with `frame.by`: relative to `frame`.
std::optional<OptionFault> frame_by_fault(const std::string& by);

// The lines or markers that frames are cut by; absent where they are cut by time. told: what a
// recording's header tells of its scan.
std::optional<ScanLines> scan_lines(const std::string& by, const ScanOptions& options,
                                    const std::optional<ScanLines>& told);

}  // namespace splid
