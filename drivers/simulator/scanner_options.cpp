#include "drivers/simulator/scanner_options.hpp"

#include <array>
#include <string>
#include <utility>

namespace splid::simulator {

void ScannerOptions::describe(OptionVisitor& visitor) {
  visitor.number("dwell_ms", dwell_ms, {0, 1e4}, "time in each pixel of the array, ms; 0: no scan");
  visitor.number("return_ms", return_ms, {0, 1e4},
                 "time from a line's stop to the next line's start, without laser light, ms");
  visitor.number("start_ms", start_ms, {-1e6, 1e6},
                 "start of the first line, in the stream's time, ms");
  visitor.flag("both_ways", both_ways,
               "the second, fourth, ... row of a picture goes from right to left");
  visitor.integer("line_start_marker", line_start_marker, 1, 15,
                  "N of the marker:N at the start of a line");
  visitor.integer("line_stop_marker", line_stop_marker, 1, 15,
                  "N of the marker:N at the end of a line");
  visitor.integer("frame_marker", frame_marker, 0, 15,
                  "N of the marker:N at the start of a picture, in one record with its first "
                  "line's marker; 0: none");
}

std::optional<OptionFault> ScannerOptions::validate(std::int64_t encoder_marker) const {
  const std::array<std::pair<const char*, std::int64_t>, 4> markers = {
      {{"the encoder's sample clock", encoder_marker},
       {"line_start_marker", line_start_marker},
       {"line_stop_marker", line_stop_marker},
       {"frame_marker", frame_marker}}};
  for (std::size_t i = 1; i < markers.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if ((markers[i].second & markers[k].second) == 0) continue;
      return OptionFault{std::string("/") + markers[i].first,
                         "is " + std::to_string(markers[i].second) + "; it shares a bit with " +
                             markers[k].first + ", " + std::to_string(markers[k].second) +
                             "; give each a bit of its own: 1, 2, 4 or 8"};
    }
  }
  return std::nullopt;
}

}  // namespace splid::simulator
