#pragma once

#include <cstddef>
#include <optional>

#include "estimator/calibration/calibration.hpp"
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

  // The number of signal photons that a frame needs to tell the delay from the right one, and be
  // wrong once in a thousand frames. The nats that photons tell have a variance of twice their
  // number, so that 20 nats are needed. Infinity where no number of photons is enough.
  [[nodiscard]] double photons_to_tell() const;
};

// The background of [P]'s experiment: photons in a ns, over the signal photons of a pulse.
inline constexpr double usual_background_per_signal = 1.75e-4 / 13.5e-4;

// The delay that is hardest to tell from the right one. A pulse that then lies d widths from one of
// the pattern's tells d^2 / 2 nats a photon, and at most what a pulse on the background alone
// tells. Of a calibrated pattern the part that its times' own deviations make is taken off. The
// delays tried are those of the highest side lobe and of each pulse from the first one; of segments
// in turn those of whole periods. Absent for a single pulse, and where a segment has more than
// 2,000.
std::optional<SideLobe> hardest_delay(const Pattern& pattern, const PulseShape& shape,
                                      double background_per_signal = usual_background_per_signal);

// How many ranges a frame of frame_s cannot tell apart, in the light of the calibration's
// recording: 1 for most patterns, and up to the number of pulses where these are as even as a laser
// at 80 MHz makes them. The pattern's range is then known modulo the period over this number.
//
// A pattern that is turned by some pulses differs from itself by the differences of times and
// amplitudes alone, and the recording tells the two apart with half of their chi squared, in nats.
std::size_t ranges_alike(const Calibration& calibration, double frame_s);

}  // namespace splid::calibration
