#pragma once

#include <vector>

#include "estimator/calibration/phase_histogram.hpp"

namespace splid::calibration {

// Photons stand out of the background by so many deviations. The highest place of the background,
// among the 10^5 places of a long pattern, stays below 5; 8 leaves room for a background that is
// not flat.
inline constexpr double outstanding_deviations = 8;

// A pulse as the photons of a target at rest show it.
struct FoundPulse {
  double time_ps = 0;  // in [0, period), after the pattern start
  double counts = 0;   // photons about this time, less the background
};

// Finds the pulses in a fold, when nobody knows what was played: the places at which the photons
// stand out of the background by eight deviations, and by a twentieth of the strongest pulse.
// width_ps: standard deviation of a detected pulse. Pulses that are closer than six widths count as
// one. Ascending in time; empty where nothing stands out.
std::vector<FoundPulse> find_pulses(const PhaseHistogram& fold, double width_ps);

}  // namespace splid::calibration
