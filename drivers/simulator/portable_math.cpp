#include "drivers/simulator/portable_math.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace splid::simulator {
namespace {

// The coefficients of both series, which are in odd powers up to the 23rd, with the highest power
// first. The compiler does the divisions.
constexpr std::size_t terms = 12;

constexpr std::array<double, terms> log_terms = [] {
  std::array<double, terms> terms_down{};
  for (std::size_t i = 0; i < terms; ++i) {
    terms_down[i] = 2.0 / static_cast<double>(2 * (terms - i) - 1);
  }
  return terms_down;
}();

constexpr std::array<double, terms> sin_terms = [] {
  std::array<double, terms> terms_down{};
  double term = 1;
  for (std::size_t i = 0; i < terms; ++i) {
    terms_down[terms - 1 - i] = term;
    term /= -static_cast<double>((2 * i + 2) * (2 * i + 3));
  }
  return terms_down;
}();

double odd_series(const std::array<double, terms>& terms_down, double x) {
  const double square = x * x;
  double sum = 0;
  for (std::size_t i = 0; i + 1 < terms; ++i) sum = (sum + terms_down[i]) * square;
  return x * terms_down[terms - 1] + x * sum;
}

}  // namespace

// Design note: log m = 2 atanh((m-1)/(m+1)) with m in [sqrt 1/2, sqrt 2), so |s| < 0.1716 and the
// first term left out, 2 s^25 / 25, is below 1e-20.
double portable_log(double x) {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  auto exponent = static_cast<double>(static_cast<std::int64_t>(bits >> 52U) - 1023);
  double m = std::bit_cast<double>((bits & 0xFFFFFFFFFFFFFULL) | 0x3FF0000000000000ULL);
  if (m > std::numbers::sqrt2) {
    m *= 0.5;
    exponent += 1;
  }
  return exponent * std::numbers::ln2 + odd_series(log_terms, (m - 1) / (m + 1));
}

// Design note: folded to a quarter turn either side of zero, where the first Taylor term left out,
// (pi/2)^25 / 25!, is 5e-21.
double sin_turns(double turns) {
  double r = turns - std::floor(turns + 0.5);
  if (r > 0.25) r = 0.5 - r;
  if (r < -0.25) r = -0.5 - r;
  return odd_series(sin_terms, 2 * std::numbers::pi * r);
}

double cos_turns(double turns) { return sin_turns((turns - std::floor(turns)) + 0.25); }

}  // namespace splid::simulator
