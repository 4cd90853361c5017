#pragma once

#include <cstddef>
#include <span>

#include "estimator/model/finding.hpp"

namespace splid::checks {

// What of the light about a fitted track a direction changes.
enum class Shape : std::size_t {
  path,   // where the pulse is, ns
  width,  // the logarithm of its width
  tail,   // the share of its light that is late by an exponential (PulseTable)
  light,  // the logarithm of the signal
  dark,   // the logarithm of the background
  early,  // flat light before the pulse, and after it, from 4 to 16 widths: photons
  late,
};
inline constexpr std::size_t shapes = 7;

// The shape times Legendre's polynomials of the time, from the order `first` to `last`.
struct Direction {
  Shape shape;
  std::size_t first, last;
};

// The frame that a direction's amount is converted for.
struct FindingScale {
  double length_ns = 0;  // t_a
  double seen_ns = 0;
};

// All that there is to say about a finding. A row without directions is found in counts by pulse or
// by phase, or in the waits between detections. Several rows may share a name.
struct FindingRow {
  FindingName name;
  const char* unit;  // of the value; empty: a ratio
  // The value from an amount: of one term with its sign, of several the root mean square over the
  // frame, of flat light the sum.
  double (*value)(double amount, const FindingScale& scale);
  const char* advice;
  std::span<const Direction> directions = {};
  bool keeps_sign = true;  // over frames: their scores add up, otherwise their gains

  // Flat light is none below 0.
  [[nodiscard]] bool is_flat_light() const {
    return !directions.empty() && directions.front().shape == Shape::early;
  }
  // A finding of this row, whose deviation is what such a gain says.
  [[nodiscard]] Finding found(double in_unit, double gain_nats) const;
};

// The rows: those with directions come first.
std::span<const FindingRow> finding_table();
inline constexpr std::size_t rows_with_directions = 8;
// Where the pulse is wider all along the frame, and at its ends.
inline constexpr std::size_t width_row = 0, parting_row = 7;
// By phase, by pulse, and of light from outside the pattern.
inline constexpr std::size_t phase_row = 8, pulse_row = 9, pattern_row = 10;
const FindingRow& row_of(FindingName name);  // the first of that name
const char* to_string(FindingName name);

}  // namespace splid::checks
