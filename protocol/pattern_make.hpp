#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/pattern.hpp"

namespace splid {

// Makes patterns from a few numbers, for `splid pattern`, the simulator and the tests. All
// amplitudes are 1. Source: [P] section 2, whose set-up has 40 pulses in 3780 ns, at least 9 ns
// apart.
//
// Errors of all functions: Error(Fault::usage), which names the value and its bound in words for a
// command line. Threads: any.

// Evenly spaced pulses. mode: baseline or ambiguous; the unambiguous delay is the spacing.
Pattern make_periodic(Mode mode, double period_ps, std::size_t pulses = 1);

// Pulses at all multiples of the sub-periods t_k below their least common multiple, each time once:
// 180 and 189 ns give 40 pulses in 3780 ns. subperiods_ps: at least two, which are whole numbers of
// picoseconds and differ from each other.
Pattern make_interleaved(std::span<const double> subperiods_ps);

struct RandomPatternOptions {
  double period_ps = 3'780'000;
  std::size_t pulses = 40;
  double min_spacing_ps = 9'000;  // between neighbours, across the period's end too
  std::uint64_t seed = 1;
};

// Pulses at random: every set of whole picoseconds that keeps the spacing is equally likely
// (Poisson disk). The first pulse is at 0.
Pattern make_random(const RandomPatternOptions& options);

// One pulse at a uniform place in each of `pulses` equal slots; min_spacing_ps is not used.
Pattern make_stratified(const RandomPatternOptions& options);

// Multiple repetition rates (MRR), one after the other: periods_ps[k] is played repeats[k] times,
// with one pulse in each period. periods_ps: at least two, which are whole numbers of picoseconds
// and differ from each other. The unambiguous delay is their least common multiple.
Pattern make_mrr(std::span<const double> periods_ps, std::span<const std::int64_t> repeats);

}  // namespace splid
