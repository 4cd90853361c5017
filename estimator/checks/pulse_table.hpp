#pragma once

#include <vector>

#include "estimator/model/pulse_shape.hpp"

namespace splid::checks {

// The configured pulse and its light, tabulated in steps of a 16th of its width, so that residual
// maps of any fit cost a look-up a place: to 1e-7 of the pulse's light.
class PulseTable {
 public:
  // How long the exponential of a tail is, in pulse widths. Tails of detectors are 2 to 5 widths
  // long, and the direction of a tail hardly depends on it.
  static constexpr double tail_widths = 2;

  explicit PulseTable(const PulseShape& shape);

  struct Values {
    double light;    // the integral of h from far before up to the offset
    double density;  // h, 1/ns
    double slope;    // h', 1/ns^2
    double tail;     // the light of the pulse if all of it were late by an exponential
  };
  [[nodiscard]] Values at(double offset_ns) const;
  // h where this share of the light is late.
  [[nodiscard]] double density_with(const Values& at, double tail) const {
    return at.density + tail * ((at.light - at.tail) / (tail_widths * width_ns_) - at.density);
  }
  [[nodiscard]] double width_ns() const { return width_ns_; }
  [[nodiscard]] double peak_ns() const { return peak_ns_; }

 private:
  double width_ns_, peak_ns_, first_ns_, per_ns_;
  std::vector<Values> nodes_;
};

}  // namespace splid::checks
