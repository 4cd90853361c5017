#pragma once

#include "estimator/paper/train_photons.hpp"

namespace splid::paper {

// The target's velocity from the observed repetition frequency f' of one pulse train:
// v = c (f - f') / (f + f'), in m/s, |v| <= max_speed_mps. 0 where the photons do not tell.
//
// f' is where the power of sum_j exp(2 pi i h f' T_j), summed over the harmonics h that the pulse
// holds, is largest.
//
// Design note: the fundamental alone is not enough. In 0.5 ms it resolves 2 kHz, while 150 m/s move
// the 10.6 MHz of a train of 94.5 ns by 11 Hz. The harmonic at 1 / (2 pi sigma), the 150th,
// resolves 150 times better, but each harmonic alone is noisy. The powers of all harmonics, each
// weighted by the pulse's own, add up to the sum of squares of the photons folded on 1 / f' and
// smoothed by the pulse (Parseval, harmonic_power.hpp). That takes one pass over photons and bins,
// where 150 sums of 9,500 phasors at each of 1,000 trial frequencies would take seconds. From one
// trial frequency to the next the ends of the train move by one bin (about sigma), which is six
// steps in the resolution of the highest harmonic; the best frequency is then refined.
//
// Adding powers loses the harmonics' phases: N_s photons of signal among N stand out by about
// N_s^2 / N sqrt(period / 10 sigma) deviations of the noise. That is 150 and more in [P]'s scenes
// with 40 pulses in 3780 ns. A single pulse in 3780 ns with the experiment's S (18 photons of 8,770
// in 50 ms) has 2, and is found in one frame of three.
//
// Cost: 2 max |g| span / width steps over the photons and period / width bins (2^18 at most), of
// which few are computed in full where they are many (rate_scan.hpp). Source: [P], section on the
// initialisation of periodic patterns.
double fourier_velocity_mps(const TrainPhotons& photons, double width_ns, double max_speed_mps);

}  // namespace splid::paper
