#pragma once

#include <cmath>

namespace splid {

// What is so many deviations off is hardly chance: once in 16,000, to either side.
inline constexpr double unlikely_deviations = 4;
// What is further off is no chance: once in 1.7 million; of many that are looked at, six.
inline constexpr double sure_deviations = 5;
inline constexpr double sure_deviations_of_many = 6;

// Deviations that add in quadrature.
//
// Design note: std::hypot guards against squares that overflow, which these never do, and its last
// bit on arm64 is not that on x86-64. Products, sums and roots are the same everywhere.
inline double in_quadrature(double a, double b) { return std::sqrt(a * a + b * b); }

}  // namespace splid
