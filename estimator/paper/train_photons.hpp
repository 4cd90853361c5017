#pragma once

#include <cstddef>
#include <optional>
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

// The target's velocity from the observed repetition frequency f' of one pulse train:
// v = c (f - f') / (f + f'), in m/s, |v| <= max_speed_mps; 0 where the photons do not tell. f' is
// where the power of sum_j exp(2 pi i h f' T_j), summed over the harmonics h that the pulse holds,
// is largest. Source: [P], initialisation of periodic patterns.
//
// Design note: the fundamental resolves 2 kHz in 0.5 ms, where 150 m/s move 10.6 MHz by 11 Hz. The
// powers of all harmonics, weighted by the pulse's own, add up to the sum of squares of the photons
// folded on 1 / f' and smoothed by the pulse (Parseval). That takes one pass over photons and bins,
// where 150 sums of 9,500 phasors at each of 1,000 frequencies take seconds. From one trial to the
// next the ends of the train move by one bin; the best is then refined. Adding powers loses the
// phases: N_s photons of signal among N stand out by N_s^2 / N sqrt(period / 10 sigma) deviations,
// 150 and more in [P]'s scenes. A single pulse in 3780 ns with the experiment's S has 2, and is
// found in one frame of three.
//
// Cost: 2 max |g| span / width steps over the photons and period / width bins (2^18 at most).
double fourier_velocity_mps(const TrainPhotons& photons, double width_ns, double max_speed_mps);

// The peak that is found in the photons of one train once their motion is taken out.
struct FoldedPeak {
  double delay_ns = 0;           // D at the train's start, in [0, period)
  double signal_per_pulse = 0;   // S, of a pulse of amplitude 1; >= 0
  double background_per_ns = 0;  // b, per ns of the pattern's clock; >= 0
};

// Folds the photons, whose motion is taken out (T_j f' / f), on the train's period, finds the peak
// of the histogram, and counts: within four pulse widths of it there are signal and background,
// outside background alone. The delay is the mean of the photons in that window. Absent without
// photons, or where the period is not above twice the window. Source: [P], censoring.
std::optional<FoldedPeak> find_folded_peak(const TrainPhotons& photons, double velocity_mps,
                                           const PulseShape& shape);

}  // namespace splid::paper
