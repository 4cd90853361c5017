#pragma once

#include <array>
#include <bitset>
#include <cstddef>

#include "estimator/fold/delay_track.hpp"
#include "estimator/model/options.hpp"

// The room likelihood/ holds the one model of a frame's light, and everything that is done with it.
// Open this file first. Its parts:
//   model.hpp           the parameters, and which of them are free
//   near_photons.hpp    the photons near the targets' tracks
//   hidden_light.hpp    the light that came while the detector was dead
//   log_likelihood.hpp  value, gradient and Hessian
//   maximizer.hpp       the maximum in the free parameters
//   information.hpp     the covariance of the free parameters at a maximum
//   bound.hpp           the bound of Cramer and Rao, for studies: [P] Eq. 12 and 13, with
//                       live_fraction.hpp
//
// Photons are folded on the pattern (see FoldedFrame). With u from -1 to 1 over the frame, and the
// tracks x_k(u) of the targets, the intensity at the phase x is
//   lambda(x, u) = b + sum_k S_k sum_p a_p h_w(x - t_p - x_k(u)),
// and the log-likelihood is
//   l = sum over photons of log lambda - integral of lambda over the time that the detector was
//       live and the tagger saw
// ([P] Eq. 1, 2, 4 and 7). h_w is the detected pulse, stretched by the factor w.

namespace splid::likelihood {

struct Target {
  DelayTrack track;
  double signal_per_pulse = 0;  // S >= 0: counts for a pulse of amplitude 1
};

// All that the intensity of a frame depends on.
struct Model {
  std::array<Target, most_targets> targets;
  std::size_t count = 0;         // targets, 1 to most_targets where the model is fitted
  double background_per_ns = 0;  // b >= 0: counts, tagger's clock
  double log_width = 0;          // the logarithm of w: 0 is the configured pulse

  void add(const Target& target) { targets.at(count++) = target; }
};

// One target. Rates that are 0 are to be fitted.
inline Model model_of(const DelayTrack& track, double signal_per_pulse = 0,
                      double background_per_ns = 0) {
  Model model;
  model.add({track, signal_per_pulse});
  model.background_per_ns = background_per_ns;
  return model;
}

// The places of the parameters in gradients, matrices and sets: four for each target, then the
// width and the background. A model of k targets has 4 k + 2 of them.
enum OfTarget : std::size_t { delay, walk, quadratic, signal, of_target };
inline constexpr std::size_t most_parameters = of_target * most_targets + 2;

constexpr std::size_t place_of(std::size_t target, OfTarget parameter) {
  return of_target * target + parameter;
}
constexpr std::size_t width_place(std::size_t targets) { return of_target * targets; }
constexpr std::size_t background_place(std::size_t targets) { return of_target * targets + 1; }
constexpr std::size_t parameters_of(std::size_t targets) { return of_target * targets + 2; }

// Which parameters are free; the others are held at the values that the model has.
using FreeSet = std::bitset<most_parameters>;

// The signal, the background, and so many terms of each track: 1 the delay of a target at rest, 2
// also its range walk, 3 also the quadratic term. The width is free with width_too.
constexpr FreeSet free_set(std::size_t targets, std::size_t track_terms, bool width_too = false) {
  unsigned long long bits = 1ULL << background_place(targets);
  if (width_too) bits |= 1ULL << width_place(targets);
  for (std::size_t k = 0; k < targets; ++k) {
    bits |= 1ULL << place_of(k, signal);
    for (std::size_t term = 0; term < track_terms; ++term) bits |= 1ULL << (of_target * k + term);
  }
  return {bits};
}

}  // namespace splid::likelihood
