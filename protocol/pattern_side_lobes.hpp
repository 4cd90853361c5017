#pragma once

#include <cstddef>
#include <optional>

#include "protocol/pattern.hpp"

namespace splid {

// Where a pattern, turned around its own period, looks most like itself.
struct SideLobe {
  std::size_t pairs = 0;  // pulses that then lie on another; all of them lie on themselves at 0
  double relative = 0;    // to the main lobe: pairs / pulses
  double shift_ps = 0;    // the smallest of the shifts with so many pairs, middle of the window
};

// Pulses count as lying on one another within two deviations of the pulses that most set-ups have,
// 100 ps: closer ones are not told apart, those farther away hardly add up.
inline constexpr double side_lobe_window_ps = 200;

// The highest side lobe of the pattern's circular autocorrelation, every pulse counting 1: the most
// differences of two pulse times within a window of window_ps. A high one takes more photons to
// tell from the target.
//
// Absent for one pulse, for several segments (they have no common circle), and above 2,000 pulses,
// where there are too many differences.
//
// Threads: any. Errors: none. Time: P^2 log P for P pulses.
std::optional<SideLobe> highest_side_lobe(const Pattern& pattern,
                                          double window_ps = side_lobe_window_ps);

}  // namespace splid
