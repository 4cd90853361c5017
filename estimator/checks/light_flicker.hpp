#pragma once

#include "estimator/model/estimate.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// Widens the deviations of values that are too low because the light of a frame varies.
//
// The light that comes while the detector is dead is taken to be the frame's mean. Where the light
// varies, dead times are where it was strong, and what is taken for their light is too little. The
// detections rise by the share e of what the light rises by, as the others come while the detector
// is dead; then the light is low by (1 - e) of its relative variance. Of a pulse with the light h
// one photon is seen with the chance 1 - exp(-h), and e = h / (exp(h) - 1); of steady light a
// detector sees the share 1 - f, and e is as much.
//
// The detections in 128 parts of the frame, each of so many whole pattern periods, vary by chance
// by e of their number at most, as detectors that are dead count more evenly than the light comes.
// The light surely varies where chance makes as much in one frame of a million. Which light varies,
// the target's or the background, these counts do not say: either may, and is then low.
//
// Design note: a likelihood that knows each part's light would mend it, but in 0.4 ms [P]'s target
// has six photons. Light that varies faster than in 0.4 ms of a frame of 50 ms is not seen.
//
// What the signal or the background may then be low by goes into its deviation, where it is more
// than half of that. frame: locked to its syncs, with its dead time modelled. share: of the light
// that a detection hides (see DeadIntervals). estimate: of that frame, with values.
void widen_by_flicker(const FrameView& frame, const PulseTrain& train, double share,
                      Estimate& estimate);

}  // namespace splid
