#pragma once

// Included by files compiled for several vector levels: no header here may emit inline functions.
#include <cstddef>
#include <cstdint>

#include "estimator/model/kernel_levels.hpp"

namespace splid {

// The loops that the search spends its time in, compiled once for each vector level (see
// kernel_choice.hpp). All arrays belong to the caller, and no two of them overlap. Every level
// gives the same bits.
struct SearchKernels {
  // Those of counts of 8, 16 or 32 bits.
  template <class Count>
  struct Of {
    // out[i] = a[i] + b[i]
    void (*add)(Count* out, const Count* a, const Count* b, std::size_t count);
    // Four lines over four rows each, which end up to three elements further on (see TaylorTree):
    // for n from 0 to 3, out[n * stride + i] = a[i] + b[i + n / 2] + c[i + (n + 1) / 2] + d[i + n],
    // in whole numbers. b, c and d go on for as many elements more; stride >= count.
    void (*add_four)(Count* out, std::size_t stride, const Count* a, const Count* b, const Count* c,
                     const Count* d, std::size_t count);
    // sums[i] += values[i]
    void (*accumulate)(Count* sums, const Count* values, std::size_t count);
    Count (*largest)(const Count* values, std::size_t count);
    // The first i, not before `from`, with a[i] + b[i] > least; count where there is none. The sums
    // fit into the type of the numbers.
    std::size_t (*first_above)(const Count* a, const Count* b, std::size_t from, std::size_t count,
                               Count least);
  };
  Of<std::uint8_t> bytes;
  Of<std::uint16_t> words;
  Of<std::uint32_t> longs;
  // out[i] = a[i] + b[i], with sums that take twice the bits.
  void (*add_8_to_16)(std::uint16_t* out, const std::uint8_t* a, const std::uint8_t* b,
                      std::size_t count);
  void (*add_16_to_32)(std::uint32_t* out, const std::uint16_t* a, const std::uint16_t* b,
                       std::size_t count);
  // cells[i] = rows[i] + the bin of the delay phases[i] - pulse, where the period has so many
  // `bins`. Phases and pulse are in 2^-32 of the period.
  void (*delay_cells)(std::uint32_t* cells, const std::uint32_t* rows, const std::uint32_t* phases,
                      std::uint32_t pulse, std::size_t count, std::uint32_t bins);
  // phases[i] = folded[i] - (delay + times[i] * (slope + curve * times[i])), modulo the period. All
  // phases are in 2^-32 of a period. What is taken off is below 2^51.
  void (*track_phases)(std::uint32_t* phases, const std::uint32_t* folded, const double* times,
                       double delay, double slope, double curve, std::size_t count);
  // [P] Eq. 20 and the folding on the pattern period, for FoldedFrame. With x = photons_ps[i] -
  // zero_ps:
  //   times_ns[i]  = x * ns_per_ps, where ns_per_ps holds the ratio of Eq. 20
  //   turns        = x * turns_per_ps - turns_at_zero - curvature * x^2
  //   phases_ns[i] = (turns - floor(turns)) * period_ns; phases_32[i] is that in 2^-32 of a period
  // |x| and |turns| are below 2^51.
  struct Fold {
    std::int64_t zero_ps;
    double ns_per_ps, turns_per_ps, turns_at_zero, curvature, period_ns;
  };
  void (*fold)(double* times_ns, double* phases_ns, std::uint32_t* phases_32,
               const std::int64_t* photons_ps, const Fold& by, std::size_t count);
  // Writes the indices of the phases whose flags[phase >> shift] is 1, in ascending order, and
  // returns their number. indices has room for count; a flag is 0 or 1.
  std::size_t (*pick)(std::uint32_t* indices, const std::uint32_t* phases,
                      const std::uint8_t* flags, int shift, std::size_t count);
};

SPLID_DECLARE_KERNELS(SearchKernels, search_kernels)

}  // namespace splid
