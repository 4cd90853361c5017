#include "estimator/checks/input_split.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace splid {

double low_by_split(const FrameView& frame, const Estimate& estimate, const PulseTrain& train) {
  constexpr double by_both = 2.4 / 12;
  constexpr double most_seen = 0.999;
  const double seen_ns = frame.seen_ns();
  const double pulses = train.pulses_per_ns * seen_ns;
  const auto photons = static_cast<double>(estimate.photons);
  const double dark = estimate.background_per_ns * seen_ns * (1 - estimate.blind_fraction);
  const double of_signal = std::max(0.0, 1 - dark / std::max(photons, 1.0));
  // Of a pulse with light x an input counts one photon with the chance 1 - e^-x.
  const auto light_of = [&](std::uint64_t of_input) {
    const double seen = static_cast<double>(of_input) * of_signal / pulses;
    return -std::log1p(-std::min(seen, most_seen));
  };
  double all = 0, squares = 0, cubes = 0;
  for (const std::uint64_t of_input : frame.photons_of_input) {
    const double x = light_of(of_input);
    all += x;
    squares += x * x;
    cubes += x * x * x;
  }
  if (!(all > 0)) return 0;
  const double mean = squares / (all * all);
  const double variance = std::max(0.0, cubes / (all * all * all) - mean * mean);
  const double in_a_pulse = estimate.signal_per_pulse * train.mean_amplitude();
  return by_both * in_a_pulse * in_a_pulse * variance;
}

}  // namespace splid
