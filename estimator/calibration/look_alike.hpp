#pragma once

#include <optional>
#include <vector>

#include "estimator/model/pulse_shape.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// A delay that a pattern's photons can take for the right one: shifted by so much, the pattern
// looks like itself.
struct LookAlike {
  double shift_ps = 0;  // in (0, what delays are told apart modulo)
  double nats_per_photon =
      0;  // log-likelihood that each signal photon is expected to speak against
          // it (Kullback and Leibler's divergence); 0: nothing ever tells it
};

// What the photons are like that have to tell delays apart.
struct PatternLight {
  // Background photons in a ns over signal photons of a pulse of mean amplitude. Default: that of
  // [P]'s experiment.
  double background_per_signal = 1.75e-4 / 13.5e-4;
};

// The delays hardest to tell from the right one, hardest first, `most` at most; none for a pattern
// of one pulse. For pulses that all lie on others again, off by d deviations of their width on
// average, what a photon tells is d^2 / 2 nats: an even comb's copies stay alike however much light
// there is. Of a calibrated pattern, what its times' own deviations make of it is taken off.
//
// Of patterns with more than 2,000 pulses a segment none is looked for.
//
// Threads: any. Errors: none. Allocates; a second for 2,000 pulses.
std::vector<LookAlike> look_alikes(const Pattern& pattern, const PulseShape& shape,
                                   const PatternLight& light = {}, std::size_t most = 64);

// How many signal photons a frame needs to tell it from the right delay, with a wrong one in a
// thousand: the nats that they tell spread as much as they are many, so that takes 20. Infinity
// where no number does.
double photons_to_tell(const LookAlike& delay);

// The spacing of the delays that so many signal photons leave alike, where these divide what the
// pattern is taken to be unambiguous to: then the range is known modulo that spacing alone. Absent
// where all delays are told apart, or where those that are not make no even spacing.
std::optional<double> even_spacing_ps(const std::vector<LookAlike>& delays,
                                      double unambiguous_delay_ps, double signal_photons,
                                      double width_ps);

}  // namespace splid
