#pragma once

// Included by a file compiled for several vector levels: no header here may emit inline functions.
#include <cstddef>

#include "estimator/model/kernel_levels.hpp"

namespace splid {

// The loop that the likelihoods spend their time in, compiled once for each vector level (see
// vector_level.hpp). All arrays belong to the caller, and no two of them overlap. Every level gives
// the same bits.
struct PulseKernels {
  // A gaussian's density h = peak exp(-x^2 / 2) at x = inverse_sigma offsets[i], and its first two
  // derivatives, to 1e-15 of what they are made of. h is 0 beyond 37.4 standard deviations, where
  // it is 1e-304 of its peak. Offsets are finite.
  void (*gaussian)(double* h, double* d1, double* d2, const double* offsets, double inverse_sigma,
                   double peak, std::size_t count);
};

SPLID_DECLARE_KERNELS(PulseKernels, pulse_kernels)

}  // namespace splid
