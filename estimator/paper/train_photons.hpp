#pragma once

#include <cstddef>
#include <vector>

#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/units.hpp"

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

// A train is folded on so many bins at most.
inline constexpr double most_fold_bins = 0x1p18;

// The photons folded on 1 / f' for one f' = (1 - g) / period, in bins of about a pulse width, and
// smoothed by 1, 2, 1, as the pulse is. Bin k is about k / bins turns. Each photon is shared
// between the two bins beside it, so that the fold is continuous in g. rate: g, in ns per ns.
std::vector<double> smoothed_fold(const TrainPhotons& photons, std::size_t bins, double rate);

// The place on a circle of period_ns where the most weight lies within width_ns.
struct Cluster {
  double begin_ns = 0;   // in [0, period)
  double weight = 0;     // of all points in [begin, begin + width]
  double middle_ns = 0;  // their mean, in [0, period)
};

// points_ns: in [0, period_ns), with one weight each.
Cluster find_largest_cluster(const std::vector<double>& points_ns,
                             const std::vector<double>& weights, double period_ns, double width_ns);

// Leaves only the photons of the largest cluster of T mod t_k: those that came from the pulses of
// another sub-period lie at many places. width_ns: has to hold the target's motion. The number of
// photons counted stays, as the background is that of the period. Source: [P], initialisation.
void keep_largest_cluster(TrainPhotons& photons, double width_ns);

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
