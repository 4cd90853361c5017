#pragma once

namespace splid {

// The nearest whole number, of |value| < 2^51. Design note: rounds by adding 1.5 * 2^52, in a fifth
// of the time of the library's call, for which the baseline instruction set has no instruction.
inline double round_quickly(double value) {
  constexpr double rounder = 0x1.8p52;
  return (value + rounder) - rounder;
}

}  // namespace splid
