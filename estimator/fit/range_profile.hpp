#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "estimator/model/options.hpp"
#include "estimator/model/pulse_shape.hpp"

namespace splid {

// The light beside a line: photons counted by how far from the line's pulses they are. Targets that
// are close to each other and move together show in it one beside the other. It tells in some
// microseconds where a joint fit of them should begin.
//
// Threads: one thread for each object, which holds scratch. Errors: none. No allocation.
class RangeProfile {
 public:
  // The bins, in pulse widths from the pulses' peaks.
  static constexpr double first_widths = -14;
  static constexpr double bin_widths = 0.5;
  static constexpr std::size_t bins = 56;
  using Counts = std::array<double, bins>;
  // Light of the pulse's shape.
  struct Target {
    double offset_ns = 0;  // of its pulses from those of the line
    double photons = 0;
  };

  explicit RangeProfile(const PulseShape& shape);

  // counts: photons in the bins. dark: photons of the background in each bin.
  void see(const Counts& counts, double dark);
  // Moves targets towards where they explain the counts best, and gives them the photons that they
  // explain (expectation maximisation). targets: up to most_targets.
  void settle(std::span<Target> targets);
  // The brightest light that these targets and the background do not explain, where it is more than
  // chance and not much less than that of the weakest of them.
  std::optional<Target> unexplained(std::span<const Target> targets);

 private:
  void light_of(const Target& target, Counts& light);
  Counts& light_of_all(std::span<const Target> targets);

  const PulseShape& shape_;
  double bin_ns_;
  Counts places_ns_{};  // of the bins' middles
  Counts counts_{};
  double dark_ = 0;
  std::array<Counts, most_targets> light_{};
  Counts all_{}, offsets_ns_{}, d1_{}, d2_{};
};

}  // namespace splid
