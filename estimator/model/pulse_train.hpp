#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimator/model/comb.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// What the generator plays in one pattern period, in the pattern's own clock: combs in turn, each
// over a stretch of the period. Every mode but MRR has a single stretch; MRR has one for each
// repetition period.
struct PulseTrain {
  struct Stretch {
    Comb comb;  // repeats over the stretch, from its begin
    double begin_ns = 0;
    double end_ns = 0;  // of emission, within the pattern period
    // The comb's periods in the train's circle, or 0 where that is no multiple of them.
    std::uint32_t copies = 1;
    std::vector<double> subperiods_ns;  // an interleaved comb is all n t_k of these; else empty
  };

  std::vector<Stretch> stretches;  // ascending, without gaps, from 0 to period_ns
  double period_ns = 0;            // of the pattern
  double circle_ns = 0;  // delays are told apart modulo this: the pattern period, or for MRR the
                         // unambiguous delay, which its pattern period exceeds
  double amplitude_per_ns = 0;  // mean over the period
  double pulses_per_ns = 0;     // mean over the period
  double closest_ns = 0;        // smallest distance between two pulses of a stretch

  explicit PulseTrain(const Pattern& pattern);

  // Of a time in [0, period_ns).
  [[nodiscard]] std::size_t stretch_at(double time_ns) const;
  [[nodiscard]] bool single() const { return stretches.size() == 1; }
};

// Shifts in (0, circle) by which a train nearly fits itself, delays that a frame can take for the
// right one: for a single comb those of near_copies_ns(comb) within three pulse widths; for several
// those within eight, since a wrong velocity makes up for part of what they differ by (99.9 and
// 104.1 ns: 124 periods of one are 119 of the other less 0.3 ns). Ascending.
std::vector<double> near_copies_ns(const PulseTrain& train, double width_ns);

// One for each stretch.
std::vector<CombWindow> comb_windows(const PulseTrain& train, double first_ns, double last_ns);

// The most pulses that any phase has in any of them, at least 1.
std::size_t widest_overlap(const std::vector<CombWindow>& windows);

}  // namespace splid
