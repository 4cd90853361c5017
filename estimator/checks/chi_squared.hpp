#pragma once

#include <cmath>

namespace splid {

// A sum of squares of so many normal numbers, over their number, that chance exceeds in one of a
// million. The cube root of such a sum is nearly normal (Wilson and Hilferty 1931).
inline double million_of_chi_squared(double degrees) {
  constexpr double million_deviations = 4.753;  // of a normal number: above it, one of a million
  const double spread = 2 / (9 * degrees);
  return std::pow(1 - spread + million_deviations * std::sqrt(spread), 3);
}

}  // namespace splid
