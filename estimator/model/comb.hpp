#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "protocol/pattern.hpp"

namespace splid {

// The pulses of one pattern period (or of one repetition period of MRR) as the estimator uses them:
// in ns of the pattern's own, calibrated clock.
struct Comb {
  double period_ns = 0;
  std::vector<double> times_ns;    // in [0, period_ns), ascending
  std::vector<double> amplitudes;  // one for each time, relative, > 0
  double total_amplitude = 0;
  double closest_ns = 0;  // smallest distance between two pulses, around the period's end too
  bool uniform = true;    // all amplitudes alike

  // segment: valid. Pulses of amplitude zero are left out.
  explicit Comb(const PatternSegment& segment);
  // How far after a time the nearest pulse is, around the period's end too; below 0: before it.
  [[nodiscard]] double to_nearest_ns(double time_ns) const;
};

// A strong side lobe has so much of the light on the pulses again, and of the gain. All others have
// less, and where the combs of two targets meet, the places that both make have more.
inline constexpr double strong_side_lobe = 0.7;

// The strong side lobes of a comb's autocorrelation: shifts in (0, period), ns, ascending, by which
// at least 70 % of the comb's light falls on its own pulses again, to within tolerance_ns. A frame
// can take a delay that is off by such a shift for the right delay. Random patterns have none.
// Interleaved patterns have none either: their side lobes have half of the light.
std::vector<double> strong_side_lobes_ns(const Comb& comb, double tolerance_ns);

// Finds, for a phase in [0, period), the pulses p whose windows [t_p + first, t_p + last] the phase
// may lie in, by one look into a table. Pulses of the periods before and after are among them, at
// t_p + m period.
class CombWindow {
 public:
  // first_ns < last_ns.
  CombWindow(const Comb& comb, double first_ns, double last_ns);

  struct Pulse {
    double time_ns;
    double amplitude;
  };
  // The pulses near a phase; a few of them may still lie outside their window. phase_32: the phase
  // in 2^-32 of a period.
  [[nodiscard]] std::span<const Pulse> candidates(std::uint32_t phase_32) const {
    const Range range = buckets_[phase_32 >> shift_];
    return {pulses_.data() + range.begin, range.count};
  }
  // The amplitude of all pulses before the candidates of a phase, less a constant that is the same
  // for all phases; candidates: as candidates() gave them.
  [[nodiscard]] double amplitude_before(std::span<const Pulse> candidates) const {
    return amplitudes_before_[static_cast<std::size_t>(candidates.data() - pulses_.data())];
  }
  // Its sum over many phases.
  [[nodiscard]] double amplitude_before(std::span<const std::uint32_t> phases_32) const;
  [[nodiscard]] double amplitude_per_ns() const { return amplitude_per_ns_; }
  // Which of the comb's pulses a candidate is.
  [[nodiscard]] std::size_t index_of(const Pulse& pulse) const {
    return static_cast<std::size_t>(&pulse - pulses_.data()) % pulses_a_period_;
  }
  // flags()[phase_32 >> shift()] is 1 where candidates(phase_32) has any pulse, else 0.
  [[nodiscard]] const std::uint8_t* flags() const { return flags_.data(); }
  [[nodiscard]] int shift() const { return shift_; }
  [[nodiscard]] double first_ns() const { return first_ns_; }
  [[nodiscard]] double last_ns() const { return last_ns_; }
  // The amplitude that all pulses have, or 0 where they differ.
  [[nodiscard]] double uniform_amplitude() const { return uniform_amplitude_; }
  // The largest number of candidates that any phase has.
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
  double amplitude_per_ns_;
  std::vector<Pulse> pulses_;  // ascending in time, with their copies in the periods around
  std::vector<double> amplitudes_before_;  // of each of them, and of a pulse after the last
  std::vector<Range> buckets_;
  std::vector<std::uint8_t> flags_;
};

}  // namespace splid
