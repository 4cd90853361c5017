#include "estimator/likelihood/likelihood_kernels.hpp"

namespace splid::SPLID_KERNEL_LEVEL {
namespace {

constexpr std::size_t lanes = LikelihoodKernels::lanes;
using Lanes [[gnu::vector_size(lanes * sizeof(double))]] = double;

// sums += a[0 to 7] b[0 to 7]
inline void add_products(Lanes& sums, const double* a, const double* b) {
  Lanes x, y;
  __builtin_memcpy(&x, a, sizeof x);
  __builtin_memcpy(&y, b, sizeof y);
  sums += x * y;
}

// Design note: added in the same order at every level.
inline double sum_of(const Lanes& x) {
  return ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7]));
}

inline double quadratic_at(double s) { return 6 * s * s - 0.5; }

void offsets(double* __restrict out, const double* __restrict residuals,
             const double* __restrict shares, const LikelihoodKernels::Placing& placing,
             std::size_t count) {
  const LikelihoodKernels::Placing by = placing;
  for (std::size_t i = 0; i < count; ++i) {
    const double s = shares[i];
    const double moved = by.delay + s * by.walk + quadratic_at(s) * by.quadratic;
    out[i] = by.scale * (residuals[i] - moved);
  }
}

template <bool adds>
void put_light(const LikelihoodKernels::Light& light, const LikelihoodKernels::Pulse& pulse,
               const double* scale, std::size_t count) {
  double* __restrict h = light.h, * __restrict d1 = light.d1, * __restrict d2 = light.d2;
  const LikelihoodKernels::Pulse of = pulse;
  const double by_h = scale[0], by_d1 = scale[1], by_d2 = scale[2];
  for (std::size_t i = 0; i < count; ++i) {
    const double a = of.amplitude[i];
    h[i] = (adds ? h[i] : 0) + by_h * (a * of.h[i]);
    d1[i] = (adds ? d1[i] : 0) + by_d1 * (a * of.d1[i]);
    d2[i] = (adds ? d2[i] : 0) + by_d2 * (a * of.d2[i]);
  }
}

void add_by_width(const LikelihoodKernels::Light& by_width, const LikelihoodKernels::Pulse& pulse,
                  const double* scale, std::size_t count) {
  double* __restrict dw = by_width.h, * __restrict dw1 = by_width.d1, * __restrict dww = by_width.d2;
  const LikelihoodKernels::Pulse of = pulse;
  const double by_dw = scale[0], by_dw1 = scale[1], by_dww = scale[2];
  for (std::size_t i = 0; i < count; ++i) {
    const double y = of.offset[i], h = of.h[i], d1 = of.d1[i], d2 = of.d2[i], a = of.amplitude[i];
    dw[i] -= by_dw * (a * (h + y * d1));
    dw1[i] -= by_dw1 * (a * (2 * d1 + y * d2));
    dww[i] += by_dww * (a * (h + y * (3 * d1 + y * d2)));
  }
}

void add_scaled(double* __restrict out, double factor, const double* __restrict a,
                std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) out[i] += factor * a[i];
}

void product(double* __restrict out, double factor, const double* __restrict a,
             const double* __restrict b, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) out[i] = factor * (a[i] * b[i]);
}

void invert(double* __restrict inverse, const double* __restrict intensity, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) inverse[i] = 1 / intensity[i];
}

void weigh(double* __restrict powers, std::size_t stride, std::size_t terms,
           const double* __restrict roots, const double* __restrict shares, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) powers[i] = roots[i];
  if (terms < 2) return;
  double* __restrict once = powers + stride, * __restrict twice = powers + 2 * stride;
  for (std::size_t i = 0; i < count; ++i) {
    once[i] = powers[i] * shares[i];
    twice[i] = once[i] * shares[i];
  }
  if (terms < 3) return;
  double* __restrict curved = twice + stride, * __restrict both = curved + stride, * __restrict square = both + stride;
  for (std::size_t i = 0; i < count; ++i) {
    const double term = quadratic_at(shares[i]);
    curved[i] = powers[i] * term;
    both[i] = once[i] * term;
    square[i] = curved[i] * term;
  }
}

void divide(const LikelihoodKernels::Parts& parts, const LikelihoodKernels::Light& light,
            const double* __restrict inverse, const double* __restrict roots, const double* scale,
            std::size_t count) {
  double* __restrict over = parts.over, * __restrict first = parts.first;
  double* __restrict density = parts.density, * __restrict second = parts.second;
  const double* __restrict h = light.h, * __restrict d1 = light.d1, * __restrict d2 = light.d2;
  const double by_h = scale[0], by_d1 = scale[1], by_d2 = scale[2];
  for (std::size_t i = 0; i < count; ++i) {
    const double weighted = inverse[i] * roots[i];
    const double slope = by_d1 * d1[i];
    over[i] = slope * inverse[i];
    first[i] = slope * weighted;
    density[i] = by_h * (h[i] * weighted);
    second[i] = by_d2 * (d2[i] * weighted);
  }
}

// Design note: four rows at a time, so that `a` is read once for them. Each row's sum is the same
// whichever rows stand beside it.
void dots(double* __restrict sums, const double* __restrict a, const double* __restrict rows,
          std::size_t stride, std::size_t number, std::size_t count) {
  std::size_t n = 0;
  for (; n + 4 <= number; n += 4) {
    const double* row = rows + n * stride;
    Lanes first = {}, second = {}, third = {}, fourth = {};
    for (std::size_t i = 0; i < count; i += lanes) {
      add_products(first, a + i, row + i);
      add_products(second, a + i, row + stride + i);
      add_products(third, a + i, row + 2 * stride + i);
      add_products(fourth, a + i, row + 3 * stride + i);
    }
    sums[n] = sum_of(first);
    sums[n + 1] = sum_of(second);
    sums[n + 2] = sum_of(third);
    sums[n + 3] = sum_of(fourth);
  }
  for (; n < number; ++n) {
    Lanes sum = {};
    for (std::size_t i = 0; i < count; i += lanes) {
      add_products(sum, a + i, rows + n * stride + i);
    }
    sums[n] = sum_of(sum);
  }
}

void products(double* __restrict out, const double* __restrict intensity, std::size_t count) {
  for (std::size_t n = 0; n < count / lanes; ++n) {
    const double* of = intensity + n * lanes;
    out[n] = ((of[0] * of[4]) * (of[2] * of[6])) * ((of[1] * of[5]) * (of[3] * of[7]));
  }
}

}  // namespace

extern const LikelihoodKernels likelihood_kernels;
const LikelihoodKernels likelihood_kernels = {
    offsets, put_light<false>, put_light<true>, add_by_width, add_scaled,
    product, invert,           weigh,           divide,       dots,
    products};

}  // namespace splid::SPLID_KERNEL_LEVEL
