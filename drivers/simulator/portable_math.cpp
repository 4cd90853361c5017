#include "drivers/simulator/portable_math.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace splid::simulator {

// Design note: log m = 2 atanh((m-1)/(m+1)) with m in [sqrt 1/2, sqrt 2), so |s| < 0.1716 and the
// twelfth term of the series is below 1e-18.
double portable_log(double x) {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  auto exponent = static_cast<double>(static_cast<std::int64_t>(bits >> 52U) - 1023);
  double m = std::bit_cast<double>((bits & 0xFFFFFFFFFFFFFULL) | 0x3FF0000000000000ULL);
  if (m > std::numbers::sqrt2) {
    m *= 0.5;
    exponent += 1;
  }
  const double s = (m - 1) / (m + 1);
  const double z = s * s;
  double sum = 0;
  for (int k = 23; k >= 3; k -= 2) sum = (sum + 1.0 / k) * z;
  return exponent * std::numbers::ln2 + (2 * s + 2 * s * sum);
}

// Design note: folded to a quarter turn either side of zero, where the Taylor term after the last
// kept one, (pi/2)^25 / 25!, is 5e-21.
double sin_turns(double turns) {
  double r = turns - std::floor(turns + 0.5);
  if (r > 0.25) r = 0.5 - r;
  if (r < -0.25) r = -0.5 - r;
  const double angle = 2 * std::numbers::pi * r;
  const double square = angle * angle;
  double sum = 1;
  for (int k = 23; k >= 3; k -= 2) sum = 1 - sum * square / (k * (k - 1));
  return angle * sum;
}

double cos_turns(double turns) { return sin_turns((turns - std::floor(turns)) + 0.25); }

}  // namespace splid::simulator
