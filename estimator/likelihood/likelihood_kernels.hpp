#pragma once

// Included by a file compiled for several vector levels: no header here may emit inline functions.
#include <cstddef>

#include "estimator/model/kernel_levels.hpp"

namespace splid {

// The loops that the likelihood spends its time in beside the pulse's own, compiled once for each
// vector level (see vector_level.hpp). All arrays belong to the caller, and no two of them overlap.
// Every level gives the same bits.
struct LikelihoodKernels {
  static constexpr std::size_t lanes = 8;  // that sums are taken in; counts are multiples of it
  // How far photons are from a target's pulses: offsets[i] = scale (residuals[i] - delay -
  // walk shares[i] - quadratic P_2), with P_2 at the share; see DelayTrack.
  struct Placing {
    double delay, walk, quadratic, scale;
  };
  void (*offsets)(double* offsets, const double* residuals, const double* shares,
                  const Placing& placing, std::size_t count);
  // A target's intensity at photons: a pulse's amplitude * h, and its derivatives by the offset.
  // scale[0] to scale[2]: of h, h' and h''. Sets it, or adds a pulse's.
  struct Light {
    double *h, *d1, *d2;
  };
  struct Pulse {
    const double *amplitude, *offset, *h, *d1, *d2;
  };
  void (*set_light)(const Light& light, const Pulse& pulse, const double* scale, std::size_t count);
  void (*add_light)(const Light& light, const Pulse& pulse, const double* scale, std::size_t count);
  // Adds the derivatives of amplitude * h by the logarithm of the pulse's width w: h[i] of h
  // itself, d1[i] of its derivative by the offset, and d2[i] the second one of h. With y the offset
  // in units in which the pulse is the configured one,
  //   dh/dw = -(h + y h')   dh'/dw = -(2 h' + y h'')   d2h/dw2 = h + 3 y h' + y^2 h''
  void (*add_by_width)(const Light& by_width, const Pulse& pulse, const double* scale,
                       std::size_t count);
  // out[i] += factor a[i]
  void (*add_scaled)(double* out, double factor, const double* a, std::size_t count);
  // out[i] = factor a[i] b[i]
  void (*product)(double* out, double factor, const double* a, const double* b, std::size_t count);
  // inverse[i] = 1 / intensity[i]
  void (*invert)(double* inverse, const double* intensity, std::size_t count);
  // Rows of powers, `stride` numbers apart: the roots; with terms 2 or more also the roots times
  // the share and its square; with terms 3 the roots times P_2, share P_2 and P_2^2.
  void (*weigh)(double* powers, std::size_t stride, std::size_t terms, const double* roots,
                const double* shares, std::size_t count);
  // The parts of a target's derivatives, of its light over the intensity. Written are
  //   over[i] = scale[1] d1 / intensity, and times the root of the weight:
  //   first[i] = over[i], density[i] = scale[0] h / intensity, second[i] = scale[2] d2 / intensity
  struct Parts {
    double *over, *first, *density, *second;
  };
  void (*divide)(const Parts& parts, const Light& light, const double* inverse, const double* roots,
                 const double* scale, std::size_t count);
  // sums[n] = the sum of a[i] rows[n stride + i], for so many rows
  void (*dots)(double* sums, const double* a, const double* rows, std::size_t stride,
               std::size_t number, std::size_t count);
  // products[n] = the product of intensity[8 n] to intensity[8 n + 7]
  void (*products)(double* products, const double* intensity, std::size_t count);
};

SPLID_DECLARE_KERNELS(LikelihoodKernels, likelihood_kernels)

}  // namespace splid
