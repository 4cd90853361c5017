#pragma once

#include <optional>

#include "estimator/calibration/phase_histogram.hpp"

namespace splid::calibration {

// The width of the pulses in a fold, as a standard deviation in ps, when nobody knows what was
// played: how close together pairs of photons come. Pairs of photons of one pulse are at most as
// far apart as the pulse is wide; all other pairs are anywhere. To within a third for a gaussian,
// for other shapes for a gaussian of about the same half width. About half of the fold's bin where
// the pulses are narrower than that. Absent where the photons show no pulses.
std::optional<double> width_by_pairs_ps(const PhaseHistogram& fold);

}  // namespace splid::calibration
