#pragma once

#include <cmath>

namespace splid {

// Chance exceeds so many deviations once in a million normal numbers.
inline constexpr double million_deviations = 4.75;
// What is further off is no chance: once in 1.7 million, to either side.
inline constexpr double sure_deviations = 5;

// Chi squared of so many degrees that is as rare as a normal number of so many deviations, and the
// other way. The cube root of chi squared is nearly normal (Wilson and Hilferty 1931): good to 0.1
// deviations from two degrees on.
inline double chi_squared_of(double deviations, double degrees) {
  const double part = 2 / (9 * degrees);
  return degrees * std::pow(1 - part + deviations * std::sqrt(part), 3);
}
inline double deviations_of(double chi_squared, double degrees) {
  const double part = 2 / (9 * degrees);
  return (std::cbrt(chi_squared / degrees) - (1 - part)) / std::sqrt(part);
}

}  // namespace splid
