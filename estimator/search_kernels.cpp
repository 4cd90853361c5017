#include "estimator/search_kernels.hpp"

namespace splid::SPLID_KERNEL_LEVEL {
namespace {

template <class Count>
void add(Count* __restrict out, const Count* __restrict a, const Count* __restrict b,
         std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<Count>(a[i] + b[i]);
}

template <class Count>
Count largest(const Count* values, std::size_t count) {
  Count most = 0;
  for (std::size_t i = 0; i < count; ++i) most = values[i] > most ? values[i] : most;
  return most;
}

void delay_bins(std::uint32_t* __restrict cells, std::uint32_t phase,
                const std::uint32_t* __restrict pulses, std::size_t count, std::uint32_t bins) {
  for (std::size_t p = 0; p < count; ++p) {
    const std::uint32_t delay = phase - pulses[p];
    cells[p] = static_cast<std::uint32_t>((static_cast<std::uint64_t>(delay) * bins) >> 32);
  }
}

}  // namespace

extern const SearchKernels search_kernels;
const SearchKernels search_kernels = {add<std::uint16_t>, add<std::uint32_t>,
                                      largest<std::uint16_t>, largest<std::uint32_t>, delay_bins};

}  // namespace splid::SPLID_KERNEL_LEVEL
