#pragma once

#include <cstdint>
#include <optional>

#include "protocol/options.hpp"

namespace splid::simulator {

// A scanner that turns one detector to the pixels of the scene's array, one after another, row by
// row from the top. It rests in each direction for the dwell. From a line's stop to the next line's
// start no laser light comes back. JSON: `source`/`scanner`.
//
// Design note: a beam that sweeps over an oblique surface would measure the surface's slope as a
// velocity. A scanner that steps shows what the estimator makes of the target's own motion.
struct ScannerOptions {
  double dwell_ms = 0;                 // 0: no scan
  double return_ms = 0;                // 0: a stop and the next start have one time
  double start_ms = 0;                 // of the first line; < 0: the stream starts within the scan
  bool both_ways = false;              // rows 1, 3, ... of a picture go from right to left
  std::int64_t line_start_marker = 1;  // marker bits, the N of `marker:N`
  std::int64_t line_stop_marker = 2;
  std::int64_t frame_marker = 4;  // with the start of a picture's first line; 0: none

  [[nodiscard]] bool used() const { return dwell_ms > 0; }
  void describe(OptionVisitor& visitor);
  // encoder_marker: bits that another part of the scene sends; 0: none.
  [[nodiscard]] std::optional<OptionFault> validate(std::int64_t encoder_marker) const;
};

}  // namespace splid::simulator
