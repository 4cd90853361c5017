#pragma once

#include <cmath>

namespace splid {

// Chance exceeds so many deviations once in a million normal numbers.
inline constexpr double million_deviations = 4.75;
// A value that is off by less of its deviation is left as it is.
inline constexpr double least_that_matters = 0.5;
// What is further off is hardly chance: once in 16,000, to either side.
inline constexpr double unlikely_deviations = 4;
// What is further off is no chance: once in 1.7 million; of many that are looked at, six.
inline constexpr double sure_deviations = 5;
inline constexpr double sure_deviations_of_many = 6;
// A richer model with one more term gains 4.5 nats at three deviations, and so many by chance in
// one frame of a million.
inline constexpr double likely_nats = 4.5;
inline constexpr double certain_nats = 12;

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
