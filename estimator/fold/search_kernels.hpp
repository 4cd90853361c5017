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
  // A photon at `ps` less zero_ps is at time = that * ns_per_ps and turn = that * turns_per_ps -
  // turns_at_zero - bend * that^2. phases[i] = the turn's part beyond a whole number, in [0, 1),
  // times period_ns; phases_32[i] the same in 2^-32 of a period. Differences and turns are below
  // 2^51.
  struct Fold {
    std::int64_t zero_ps;
    double ns_per_ps, turns_per_ps, turns_at_zero, bend, period_ns;
  };
  void (*fold)(double* times_ns, double* phases_ns, std::uint32_t* phases_32,
               const std::int64_t* photons_ps, const Fold& by, std::size_t count);
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
namespace neon {
extern const SearchKernels search_kernels;
}

}  // namespace splid
