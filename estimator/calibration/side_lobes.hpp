#pragma once

#include <optional>
#include <vector>

#include "estimator/model/pulse_shape.hpp"
#include "protocol/pattern.hpp"

namespace splid::calibration {

// A delay that a pattern's photons can take for the right one: shifted by so much, the pattern
// looks like itself.
struct SideLobe {
  double shift_ps = 0;  // above 0, below the delay that the pattern is unambiguous to
  // The log-likelihood that each signal photon is expected to speak against this delay (the
  // divergence of Kullback and Leibler). At 0 nothing ever tells it from the right delay.
  double nats_per_photon = 0;
};

// The light that has to tell delays apart.
struct PatternLight {
  // Background photons in a ns, over the signal photons of a pulse of mean amplitude. The default
  // is that of [P]'s experiment.
  double background_per_signal = 1.75e-4 / 13.5e-4;
};

// The delays that are hardest to tell from the right one, hardest first, and not more than `most`.
// Where a shift brings all pulses onto others, off by d deviations of their width on average, a
// photon tells d^2 / 2 nats; the copies of an even comb stay alike. Of a calibrated pattern the
// part that its times' own deviations make is taken off. Empty for a single pulse, and where a
// segment has more than 2,000, which take a second. Allocates.
std::vector<SideLobe> side_lobes(const Pattern& pattern, const PulseShape& shape,
                                 const PatternLight& light = {}, std::size_t most = 64);

// The number of signal photons that a frame needs to tell a delay from the right one, and be wrong
// once in a thousand frames. The nats that photons tell have a variance of about twice their
// number, so that 20 nats are needed. Infinity where no number of photons is enough.
double photons_to_tell(const SideLobe& delay);

// The spacing of the delays that so many signal photons leave alike, where these delays divide the
// unambiguous delay evenly: the range is then known modulo that spacing alone. Absent where all
// delays are told apart, or where those that are not have no even spacing.
std::optional<double> even_spacing_ps(const std::vector<SideLobe>& delays,
                                      double unambiguous_delay_ps, double signal_photons,
                                      double width_ps);

}  // namespace splid::calibration
