#include "estimator/fold/search_kernels.hpp"

namespace splid::SPLID_KERNEL_LEVEL {
namespace {

template <class From, class To>
void add(To* __restrict out, const From* __restrict a, const From* __restrict b,
         std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<To>(a[i] + b[i]);
}

template <class Count>
void add_four_to(Count* __restrict out_0, Count* __restrict out_1, Count* __restrict out_2,
                 Count* __restrict out_3, const Count* __restrict a, const Count* __restrict b,
                 const Count* __restrict c, const Count* __restrict d, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const auto first = static_cast<Count>(a[i] + b[i]);
    const auto later = static_cast<Count>(a[i] + b[i + 1]);
    out_0[i] = static_cast<Count>(first + static_cast<Count>(c[i] + d[i]));
    out_1[i] = static_cast<Count>(first + static_cast<Count>(c[i + 1] + d[i + 1]));
    out_2[i] = static_cast<Count>(later + static_cast<Count>(c[i + 1] + d[i + 2]));
    out_3[i] = static_cast<Count>(later + static_cast<Count>(c[i + 2] + d[i + 3]));
  }
}

// Design note: four lines at once need ten vectors of the rows instead of sixteen.
template <class Count>
void add_four(Count* out, std::size_t stride, const Count* a, const Count* b, const Count* c,
              const Count* d, std::size_t count) {
  add_four_to(out, out + stride, out + 2 * stride, out + 3 * stride, a, b, c, d, count);
}

template <class Count>
void accumulate(Count* __restrict sums, const Count* __restrict values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) sums[i] = static_cast<Count>(sums[i] + values[i]);
}

template <class Count>
Count largest(const Count* values, std::size_t count) {
  Count most = 0;
  for (std::size_t i = 0; i < count; ++i) most = values[i] > most ? values[i] : most;
  return most;
}

// Whether any of so many sums is above `least`. All of them are added, so that this is one loop of
// vectors.
template <std::size_t count, class Count>
bool any_above(const Count* a, const Count* b, Count least) {
  Count most = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto sum = static_cast<Count>(a[i] + b[i]);
    most = sum > most ? sum : most;
  }
  return most > least;
}

template <class Count>
std::size_t first_above(const Count* a, const Count* b, std::size_t from, std::size_t count,
                        Count least) {
  constexpr std::size_t many = 256;
  constexpr std::size_t few = 32;
  while (from + many <= count && !any_above<many>(a + from, b + from, least)) from += many;
  while (from + few <= count && !any_above<few>(a + from, b + from, least)) from += few;
  while (from < count && static_cast<Count>(a[from] + b[from]) <= least) ++from;
  return from;
}

void delay_cells(std::uint32_t* __restrict cells, const std::uint32_t* __restrict rows,
                 const std::uint32_t* __restrict phases, std::uint32_t pulse, std::size_t count,
                 std::uint32_t bins) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t delay = phases[i] - pulse;
    cells[i] =
        rows[i] + static_cast<std::uint32_t>((static_cast<std::uint64_t>(delay) * bins) >> 32);
  }
}

// Design note: adding 1.5 * 2^52 leaves the rounded sum in the low bits of the double. Its low 32
// bits are then the phase modulo a period, without a conversion of doubles to 64-bit integers, for
// which no processor before AVX-512 has a vector instruction.
void track_phases(std::uint32_t* __restrict phases, const std::uint32_t* __restrict folded,
                  const double* __restrict times, double delay, double slope, double curve,
                  std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const double time = times[i];
    const double moved = (delay + time * (slope + curve * time)) + 0x1.8p52;
    phases[i] = folded[i] - static_cast<std::uint32_t>(__builtin_bit_cast(std::uint64_t, moved));
  }
}

// All bits where the highest one is set, and none where it is not.
inline std::uint64_t mask_of_sign(std::uint64_t bits) { return 0 - (bits >> 63U); }

// Design note: without SSE 4.1, floor() is a call into the library. Adding 1.5 * 2^52 and taking it
// off again rounds to a whole number, in vectors of any width. A whole number that is added to the
// bits of 1.5 * 2^52 is added to its value. Both choices are made with masks, since a compiler may
// not add 1 where the sum is not asked for. Without vectors, and with a branch that no processor
// foresees, the loop takes seven times as long.
void fold(double* __restrict times_ns, double* __restrict phases_ns,
          std::uint32_t* __restrict phases_32, const std::int64_t* __restrict photons_ps,
          const SearchKernels::Fold& by, std::size_t count) {
  constexpr double rounder = 0x1.8p52;
  constexpr auto rounder_bits = __builtin_bit_cast(std::int64_t, rounder);
  constexpr auto one_bits = __builtin_bit_cast(std::uint64_t, 1.0);
  const SearchKernels::Fold fold_by = by;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int64_t since_ps = photons_ps[i] - fold_by.zero_ps;
    const double time_ps = __builtin_bit_cast(double, since_ps + rounder_bits) - rounder;
    const double per_ps = fold_by.turns_per_ps - fold_by.curvature * time_ps;
    const double all = time_ps * per_ps - fold_by.turns_at_zero;
    double part = all - ((all + rounder) - rounder);  // -1/2 to 1/2
    const auto bits = __builtin_bit_cast(std::uint64_t, part);
    const std::uint64_t one_below_0 = one_bits & mask_of_sign(bits);
    part += __builtin_bit_cast(double, one_below_0);
    // -1e-17 + 1 rounds to 1, which is 0.
    const auto added_bits = __builtin_bit_cast(std::uint64_t, part);
    const std::uint64_t below_1 = added_bits & mask_of_sign(added_bits - one_bits);
    part = __builtin_bit_cast(double, below_1);
    times_ns[i] = time_ps * fold_by.ns_per_ps;
    phases_ns[i] = part * fold_by.period_ns;
    const double low = part * 0x1p32 + rounder;
    phases_32[i] = static_cast<std::uint32_t>(__builtin_bit_cast(std::uint64_t, low));
  }
}

// Design note: without a branch, since the processor would guess wrong for the photons that are
// picked, one in twenty.
std::size_t pick(std::uint32_t* __restrict indices, const std::uint32_t* __restrict phases,
                 const std::uint8_t* __restrict flags, int shift, std::size_t count) {
  std::size_t picked = 0;
  for (std::size_t i = 0; i < count; ++i) {
    indices[picked] = static_cast<std::uint32_t>(i);
    picked += flags[phases[i] >> shift];
  }
  return picked;
}

}  // namespace

extern const SearchKernels search_kernels;
const SearchKernels search_kernels = {
    {add<std::uint8_t, std::uint8_t>, add_four<std::uint8_t>, accumulate<std::uint8_t>,
     largest<std::uint8_t>, first_above<std::uint8_t>},
    {add<std::uint16_t, std::uint16_t>, add_four<std::uint16_t>, accumulate<std::uint16_t>,
     largest<std::uint16_t>, first_above<std::uint16_t>},
    {add<std::uint32_t, std::uint32_t>, add_four<std::uint32_t>, accumulate<std::uint32_t>,
     largest<std::uint32_t>, first_above<std::uint32_t>},
    add<std::uint8_t, std::uint16_t>,
    add<std::uint16_t, std::uint32_t>,
    delay_cells,
    track_phases,
    fold,
    pick};

}  // namespace splid::SPLID_KERNEL_LEVEL
