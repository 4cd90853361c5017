#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "protocol/pattern.hpp"

namespace splid {

// The pulses of one pattern period as the estimator uses them: times in ns of the pattern's own
// (calibrated) clock, in [0, period_ns), ascending; amplitudes relative.
struct Comb {
  double period_ns = 0;
  std::vector<double> times_ns;
  std::vector<double> amplitudes;
  double total_amplitude = 0;
  double closest_ns = 0;  // smallest distance between two pulses, around the period's end too
  bool uniform = true;    // all amplitudes alike

  // Pulses of amplitude zero are left out: they are not there.
  explicit Comb(const PatternSegment& segment);
};

// Shifts in (0, period) by which at least 70 % of the comb's light falls on its own pulses again,
// to within tolerance_ns: delays that a frame can take for the right one. None for random patterns
// and for interleaved ones (which fit themselves by half). Ascending.
std::vector<double> near_copies_ns(const Comb& comb, double tolerance_ns);

// For a phase in [0, period) the pulses whose windows [t_p + first, t_p + last] it may lie in,
// found by one table look-up. Pulses beyond the period's ends are there too, at t_p + m period.
//
// Threads: const, any. Memory: 9 bytes a bucket, at most 288 KiB.
class CombWindow {
 public:
  // first_ns < last_ns.
  CombWindow(const Comb& comb, double first_ns, double last_ns);

  struct Pulse {
    double time_ns;
    double amplitude;
  };
  // phase_32: in 2^-32 of a period.
  [[nodiscard]] std::span<const Pulse> candidates(std::uint32_t phase_32) const {
    const Range range = buckets_[phase_32 >> shift_];
    return {pulses_.data() + range.begin, range.count};
  }
  // Of a candidate: which of the comb's pulses it is.
  [[nodiscard]] std::size_t index_of(const Pulse& pulse) const {
    return static_cast<std::size_t>(&pulse - pulses_.data()) % pulses_a_period_;
  }
  // flags()[phase_32 >> shift()]: 1 where candidates() has any, else 0.
  [[nodiscard]] const std::uint8_t* flags() const { return flags_.data(); }
  [[nodiscard]] int shift() const { return shift_; }
  [[nodiscard]] double first_ns() const { return first_ns_; }
  [[nodiscard]] double last_ns() const { return last_ns_; }
  // Of all pulses, or 0 where they differ.
  [[nodiscard]] double uniform_amplitude() const { return uniform_amplitude_; }
  // The most pulses that any phase has.
  [[nodiscard]] std::size_t max_overlap() const { return max_overlap_; }

 private:
  struct Range {
    std::uint32_t begin;
    std::uint32_t count;
  };
  double first_ns_;
  double last_ns_;
  int shift_;
  double uniform_amplitude_;
  std::size_t max_overlap_ = 0;
  std::size_t pulses_a_period_;
  std::vector<Pulse> pulses_;  // ascending in time, with copies at whole periods around
  std::vector<Range> buckets_;
  std::vector<std::uint8_t> flags_;
};

}  // namespace splid
