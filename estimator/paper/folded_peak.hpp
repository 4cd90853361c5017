#pragma once

#include "estimator/model/pulse_shape.hpp"
#include "estimator/paper/train_photons.hpp"

namespace splid::paper {

// The peak that is found in the photons of one train once their motion is taken out.
struct FoldedPeak {
  bool found = false;
  double delay_ns = 0;           // D at the train's start, in [0, period)
  double signal_per_pulse = 0;   // S, of a pulse of amplitude 1; >= 0
  double background_per_ns = 0;  // b, per ns of the pattern's clock; >= 0
};

// Folds the photons, whose motion is taken out (T_j f' / f), on the train's period, finds the peak
// of the histogram, and counts: within four pulse widths of it there are signal and background,
// outside background alone. The delay is the mean of the photons in that window. Not found without
// photons, or where the period is not above twice the window. Source: [P], censoring.
FoldedPeak find_folded_peak(const TrainPhotons& photons, double velocity_mps,
                            const PulseShape& shape);

}  // namespace splid::paper
