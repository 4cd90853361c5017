#pragma once

#include <vector>

#include "estimator/calibration/phase_histogram.hpp"

namespace splid {

// A pulse as a static target's photons show it.
struct FoundPulse {
  double time_ps = 0;  // in [0, period), after the pattern start
  double counts = 0;   // photons about it, less the background
};

// Finds the pulses in a fold, when nobody knows what was played: where photons stand out of the
// background by eight deviations and a twentieth of the strongest pulse. width_ps: standard
// deviation of a detected pulse; pulses closer than six of it count as one. Ascending in time.
//
// Errors: none; where no pulse stands out of the background, none is found.
std::vector<FoundPulse> find_pulses(const PhaseHistogram& fold, double width_ps);

}  // namespace splid
