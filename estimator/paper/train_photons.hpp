#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace splid::paper {

// The photons of one pulse train, folded on its period, in the pattern's clock. A target that moves
// at v = c g / (2 - g), with delay D = tau / (1 + v/c) at the train's start, has its photons at
// phase = D + g time, which is a straight line on the circle.
struct TrainPhotons {
  double period_ns = 0;
  double start_ns = 0;           // t_0 of [P] Eq. 5: when the train starts, from the frame's start
  double seen_ns = 0;            // for how long photons of the train were looked for
  double amplitude = 0;          // sum over all pulses in that time
  double counted = 0;            // photons in that time, those that are not listed below included
  std::vector<double> phase_ns;  // in [0, period)
  std::vector<double> time_ns;   // from start_ns

  [[nodiscard]] std::size_t size() const { return phase_ns.size(); }
};

// value modulo period, in [0, period).
inline double fold_on(double value, double period) {
  const double rest = value - period * std::floor(value / period);
  return rest < period ? rest : 0.0;
}

}  // namespace splid::paper
