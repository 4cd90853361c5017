#pragma once

#include "estimator/model/estimate.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// Widens the deviations of values that are too low because the light of a frame varies: dead times
// are where it was strong, and their light is taken to be the mean. Detections rise by the share e
// of what the light rises by, and the light is low by (1 - e) of its relative variance; of pulses
// with the light h, e = h / (exp(h) - 1), of steady light the live fraction.
//
// The light varies where the detections in 128 parts of the frame, of whole pattern periods, vary
// by more than chance does in one frame of a million, with e of their number as the variance.
// The counts do not tell the signal from the background: either may be low. What it
// may be low by goes into its deviation, where it is more than half of that.
//
// Design note: light that varies faster than in 0.4 ms of 50 ms is not seen. A likelihood of each
// part's light would mend it, but [P]'s target has six photons in a part.
//
// frame: locked to its syncs, with its dead time modelled. share: of the light that a detection
// hides (see DeadIntervals). estimate: of that frame, with values.
void widen_by_flicker(const FrameView& frame, const PulseTrain& train, double share,
                      Estimate& estimate);

// By how much of itself the signal of an estimate is low where a detector's inputs share the light
// unevenly; 0 where the photons of each input are not known. DeadIntervals takes each detection to
// hide the mean share of the light, but the input that gets more sees its photon earlier in the
// pulse, and counts one where several came. The first alone makes S^2 V / 12, V = sum f^3 -
// (sum f^2)^2 over the shares f. For both 2.4 times that is taken: up to one photon a pulse two
// thirds to all of it, of three photons a third (docs/evidence/data/dead-time-split.csv).
double low_by_split(const FrameView& frame, const Estimate& estimate, const PulseTrain& train);

}  // namespace splid
