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
  // Targets whose light it is.
  class Row {
   public:
    void add(const Target& target) { targets_.at(count_++) = target; }
    [[nodiscard]] std::size_t count() const { return count_; }
    [[nodiscard]] std::span<Target> all() { return std::span(targets_).first(count_); }
    [[nodiscard]] std::span<const Target> all() const { return std::span(targets_).first(count_); }

   private:
    std::array<Target, most_targets> targets_;
    std::size_t count_ = 0;
  };
  // Moves targets towards where they explain the counts best, and gives them the photons that they
  // explain (expectation maximisation).
  void settle(Row& row);
  // Adds the brightest light that the targets and the background do not explain, and lets all
  // settle, while there are less than `most` and that light is more than chance and no less than
  // such a part of the weakest of them.
  void add_unexplained(Row& row, std::size_t most, double least_of_weakest);
  // The logarithm of the likelihood of the counts, less what is the same for all rows.
  double nats(const Row& row);

 private:
  void light_of(const Target& target, Counts& light);
  const Counts& light_of_all(const Row& row);
  std::optional<Target> unexplained(const Row& row, double least_of_weakest);

  const PulseShape& shape_;
  double bin_ns_;
  Counts places_ns_{};  // of the bins' middles
  Counts counts_{};
  double dark_ = 0;
  std::array<Counts, most_targets> light_{};
  Counts all_{}, offsets_ns_{}, d1_{}, d2_{};
};

}  // namespace splid
