#pragma once

#include <cmath>

namespace splid {

// Deviations that add in quadrature.
//
// Design note: std::hypot guards against squares that overflow, which these never do, and its last
// bit on arm64 is not that on x86-64. Products, sums and roots are the same everywhere.
inline double in_quadrature(double a, double b) { return std::sqrt(a * a + b * b); }

}  // namespace splid
