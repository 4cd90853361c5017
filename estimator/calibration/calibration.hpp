#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/calibration/fold_model.hpp"
#include "estimator/calibration/phase_histogram.hpp"
#include "protocol/pattern.hpp"

namespace splid {

struct CalibratedPulse {
  double time_ps = 0;      // in [0, period), tagger's clock, after the pattern start
  double std_time_ps = 0;  // photons, syncs, and the shape's own point
  double amplitude = 0;    // the mean of all pulses is 1
  double std_amplitude = 0;
};

// What a target at rest shows of a pattern. Standard deviations are those of Poisson noise.
struct Calibration {
  double period_ps = 0;  // tagger's clock
  double std_period_ps = 0;
  std::vector<CalibratedPulse> pulses;  // ascending in time
  TabulatedPulse shape;                 // density 1/ps; its pulse_point_ps is at 0
  std::vector<double> std_density;      // 1/ps
  double width_ps = 0;                  // of a gaussian with the shape's peak
  std::uint64_t photons = 0;            // in the fold
  double signal_photons = 0;
  double background_per_ps = 0;  // photons of the whole fold
  double seconds = 0;
  bool settled = false;  // the times came to rest; false: to within a part of a width only
};

// Pulse times, amplitudes and shape by maximum likelihood of the folded photons: shape from all
// pulses laid upon each other, times and amplitudes with that shape, and again until no time moves
// by more than a tenth of its own deviation, or a thousandth of the width. Absent where no pulse
// stands out.
//
// fold: of a target at rest. width_ps: of a detected pulse, standard deviation, to within a factor
// of two; see find_pulses for what it sets.
//
// Threads: any. Errors: none. Allocates; some seconds for folds of 10^7 bins.
std::optional<Calibration> calibrate(const PhaseHistogram& fold, double width_ps);

// What a calibration says should be in the fold that it came from.
FoldModel model_of(const PhaseHistogram& fold, const Calibration& calibration);

// How well pulses have to be known.
struct CalibrationGoal {
  double std_time_ps = 5;
  double std_amplitude = 0.02;  // of the mean pulse
};

// By what factor the photons have to grow until every pulse is known that well; 1 or less: it is.
double photons_wanted(const Calibration& calibration, const CalibrationGoal& goal);

}  // namespace splid
