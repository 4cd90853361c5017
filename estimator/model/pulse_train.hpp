#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimator/model/comb.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// What the generator plays in one pattern period, in the pattern's own clock: one comb after the
// other, each over a segment of the period. Every mode but MRR has a single segment; MRR has one
// segment for each repetition period.
struct PulseTrain {
  struct Segment {
    Comb comb;  // is repeated from the segment's begin to its end
    double begin_ns = 0;
    double end_ns = 0;  // when its pulses leave, within the pattern period
    // How many of the comb's periods make the train's circle, or 0 where no whole number does.
    std::uint32_t copies = 1;
    std::vector<double> subperiods_ns;  // t_k: an interleaved comb is all n t_k; else empty
  };

  std::vector<Segment> segments;  // ascending, without gaps, from 0 to period_ns
  double period_ns = 0;           // of the pattern
  double circle_ns = 0;  // delays are told apart modulo this: the pattern period, but for MRR the
                         // unambiguous delay, which is shorter than its pattern period
  double amplitude_per_ns = 0;  // mean over the period
  double pulses_per_ns = 0;     // mean over the period
  double closest_ns = 0;        // smallest distance between two pulses of a segment

  explicit PulseTrain(const Pattern& pattern);

  // The segment that a time in [0, period_ns) lies in, and where in its comb's period.
  [[nodiscard]] std::size_t segment_at(double time_ns) const;
  struct Place {
    std::size_t segment;
    double turns;                                   // in [0, 1)
    [[nodiscard]] std::uint32_t phase_32() const {  // in 2^-32 of a period
      return static_cast<std::uint32_t>(static_cast<std::uint64_t>(turns * 0x1p32));
    }
  };
  [[nodiscard]] Place place_of(double time_ns) const;
  [[nodiscard]] bool single() const { return segments.size() == 1; }
  [[nodiscard]] double mean_amplitude() const { return amplitude_per_ns / pulses_per_ns; }
};

// The strong side lobes of a train's autocorrelation: shifts in (0, circle), ns, ascending, that a
// frame can take for the right delay. Of a single comb they are those of strong_side_lobes_ns(comb)
// to within three pulse widths, of several to within eight, since a wrong velocity makes up for a
// part: with 99.9 and 104.1 ns, 124 periods of the first are 119 of the second less 0.3 ns.
std::vector<double> strong_side_lobes_ns(const PulseTrain& train, double width_ns);

// The windows of each segment's comb, one for each segment.
std::vector<CombWindow> comb_windows(const PulseTrain& train, double first_ns, double last_ns);

// The largest number of candidates that any phase has in any of the windows, at least 1.
std::size_t widest_overlap(std::span<const CombWindow> windows);

}  // namespace splid
