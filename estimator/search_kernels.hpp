#pragma once

// Included by files compiled for several vector levels: no header here may emit inline functions.
#include <cstddef>
#include <cstdint>

namespace splid {

// The loops that the search spends its time in. All arrays are the caller's; no two overlap unless
// said so. Every level gives the same numbers: they are integers.
struct SearchKernels {
  // out[i] = a[i] + b[i]
  void (*add)(std::uint16_t* out, const std::uint16_t* a, const std::uint16_t* b,
              std::size_t count);
  void (*add_32)(std::uint32_t* out, const std::uint32_t* a, const std::uint32_t* b,
                 std::size_t count);
  // sums[i] += values[i]
  void (*accumulate)(std::uint16_t* sums, const std::uint16_t* values, std::size_t count);
  void (*accumulate_32)(std::uint32_t* sums, const std::uint32_t* values, std::size_t count);
  std::uint16_t (*largest)(const std::uint16_t* values, std::size_t count);
  std::uint32_t (*largest_32)(const std::uint32_t* values, std::size_t count);
  // cells[p] = the bin of delay phase - pulses[p], all in 2^-32 of a period, of `bins` in a period.
  void (*delay_bins)(std::uint32_t* cells, std::uint32_t phase, const std::uint32_t* pulses,
                     std::size_t count, std::uint32_t bins);
  // phases[i] = folded[i] - (delay + slope * times[i]), all phases in 2^-32 of a period, wrapping.
  // |delay + slope * times[i]| < 2^51.
  void (*line_phases)(std::uint32_t* phases, const std::uint32_t* folded, const double* times,
                      double delay, double slope, std::size_t count);
  // Indices, ascending, of the phases whose flags[phase >> shift] is not zero; returns their
  // number. indices has room for count.
  std::size_t (*pick)(std::uint32_t* indices, const std::uint32_t* phases,
                      const std::uint8_t* flags, int shift, std::size_t count);
};

namespace generic {
extern const SearchKernels search_kernels;
}
namespace x86_64_v3 {
extern const SearchKernels search_kernels;
}
namespace x86_64_v4 {
extern const SearchKernels search_kernels;
}

}  // namespace splid
