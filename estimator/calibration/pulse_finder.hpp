#pragma once

#include <optional>
#include <vector>

#include "estimator/calibration/phase_histogram.hpp"

namespace splid::calibration {

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

// The width of the pulses in a fold, as a standard deviation in ps, when nobody knows what was
// played: how close together pairs of photons come. Pairs of photons of one pulse are at most as
// far apart as the pulse is wide; all other pairs are anywhere. To within a third for a gaussian,
// for other shapes for a gaussian of about the same half width. About half of the fold's bin where
// the pulses are narrower than that. Absent where the photons show no pulses.
std::optional<double> width_by_pairs_ps(const PhaseHistogram& fold);

}  // namespace splid::calibration
