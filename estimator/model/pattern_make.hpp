#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/pattern.hpp"

namespace splid {

// Patterns from a few numbers. All amplitudes are 1. Sources: [P] section 2; its set-up has
// 3780 ns, 40 pulses, 9 ns apart at least.
//
// Errors of all: Error(Fault::usage) naming the value and its bound, in words for a command line.

// Evenly spaced pulses. mode: baseline or ambiguous; the unambiguous delay is the spacing.
Pattern make_periodic(Mode mode, double period_ps, std::size_t pulses = 1);

// The union of {n t_k} over [0, LCM of all t_k), each time once: 180 and 189 ns give 40 pulses in
// 3780 ns. subperiods_ps: at least two, whole numbers of picoseconds, different.
Pattern make_interleaved(std::span<const double> subperiods_ps);

struct RandomPatternOptions {
  double period_ps = 3'780'000;
  std::size_t pulses = 40;
  double min_spacing_ps = 9'000;  // of neighbours, the last and the next period's first included
  std::uint64_t seed = 1;
};

// Poisson disk: uniform among all sets of whole picoseconds that keep the spacing. The first pulse
// is at 0.
Pattern make_random(const RandomPatternOptions& options);

// One pulse at a uniform place in each of `pulses` equal slots; min_spacing_ps is not used.
Pattern make_stratified(const RandomPatternOptions& options);

// Multiple repetition rates in turn: one pulse a period, periods_ps[k] played repeats[k] times.
// periods_ps: at least two, whole numbers of picoseconds, different; the unambiguous delay is
// their LCM.
Pattern make_mrr(std::span<const double> periods_ps, std::span<const std::int64_t> repeats);

}  // namespace splid
