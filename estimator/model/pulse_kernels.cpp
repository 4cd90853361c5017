#include "estimator/model/pulse_kernels.hpp"

#include <cstdint>

namespace splid::SPLID_KERNEL_LEVEL {
namespace {

// e^r - 1 for |r| <= ln(2) / 2, by Taylor's series: what is left out is below 5e-18.
//
// Design note: terms are added in pairs and pairs of pairs, since each sum of a single row of terms
// waits for the one before it.
inline double exp_less_1(double r) {
  const double r2 = r * r, r4 = r2 * r2, r8 = r4 * r4;
  const double from_2 = (1.0 / 2 + r * (1.0 / 6)) + r2 * (1.0 / 24 + r * (1.0 / 120));
  const double from_6 = (1.0 / 720 + r * (1.0 / 5040)) + r2 * (1.0 / 40320 + r * (1.0 / 362880));
  const double from_10 =
      (1.0 / 3628800 + r * (1.0 / 39916800)) + r2 * (1.0 / 479001600 + r * (1.0 / 6227020800));
  return r + r2 * ((from_2 + r4 * from_6) + r8 * from_10);
}

// e^y for y <= 0, and 0 where y is below -700; to 1.5e-16 of it.
//
// Design note: e^y = 2^n e^r with n = y / ln 2, rounded. Adding 1.5 * 2^52 rounds, and leaves n in
// the low bits of the double, from where it goes into an exponent's; ln 2 is taken off in two
// parts, of which n times the first is exact. There is no call and no branch in this, so that it is
// a loop of vectors.
inline double exp_below_0(double y) {
  constexpr double rounder = 0x1.8p52;
  constexpr double per_ln_2 = 0x1.71547652b82fep+0;
  constexpr double ln_2_first = 0x1.62e42feep-1, ln_2_rest = 0x1.a39ef35793c76p-33;
  constexpr std::uint64_t exponent_of_1 = 1023;
  constexpr unsigned mantissa_bits = 52;
  const double rounded = y * per_ln_2 + rounder;
  const double n = rounded - rounder;
  const double r = (y - n * ln_2_first) - n * ln_2_rest;
  const std::uint64_t power_bits = (__builtin_bit_cast(std::uint64_t, rounded) + exponent_of_1)
                                   << mantissa_bits;
  const double all = (1 + exp_less_1(r)) * __builtin_bit_cast(double, power_bits);
  const std::uint64_t is_below = __builtin_bit_cast(std::uint64_t, y + 700) >> 63U;
  return __builtin_bit_cast(double, __builtin_bit_cast(std::uint64_t, all) & (is_below - 1));
}

void gaussian(double* __restrict h, double* __restrict d1, double* __restrict d2,
              const double* __restrict offsets, double inverse_sigma, double peak,
              std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const double x = offsets[i] * inverse_sigma;
    const double density = peak * exp_below_0(-0.5 * x * x);
    h[i] = density;
    d1[i] = -x * inverse_sigma * density;
    d2[i] = (x * x - 1) * inverse_sigma * inverse_sigma * density;
  }
}

}  // namespace

const PulseKernels pulse_kernels = {gaussian};

}  // namespace splid::SPLID_KERNEL_LEVEL
