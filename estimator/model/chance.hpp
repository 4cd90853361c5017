#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/sync/deviations.hpp"

namespace splid {

// Chance exceeds so many deviations once in a million normal numbers.
inline constexpr double million_deviations = 4.75;
// A value that is off by less of its deviation is left as it is.
inline constexpr double least_that_matters = 0.5;
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
  return (std::pow(chi_squared / degrees, 1.0 / 3) - (1 - part)) / std::sqrt(part);
}

// The chance that a normal number is below so many deviations, to 1e-14 of it above -12.
//
// Design note: std::erfc's last bit on arm64 is not that on x86-64. This is the trapezoidal rule,
// and what it leaves out of the pole nearby (Chiarella and Reichel 1968).
inline double normal_integral(double deviations) {
  constexpr double step = 0.6875, fall_of_fall = 0x1.3f26fc3a423a1p-1;  // e^(-step^2)
  const double d = std::min(std::abs(deviations), 40.0);
  double sum = 0, weight = 0x1.e2a05379f2333p-1, fall = fall_of_fall;  // e^(-at^2 / 2)
  for (int n = 0; n < 13; ++n, weight *= fall, fall *= fall_of_fall) {
    const double at = (n + 0.5) * step;
    sum += weight / (at * at + d * d);
  }
  double beyond = step / std::numbers::pi * d * std::exp(-d * d / 2) * sum;
  if (d < 9) beyond += 1 / (1 + std::exp(2 * std::numbers::pi / step * d));
  return deviations > 0 ? 1 - beyond : beyond;
}

}  // namespace splid
