#pragma once

#include "estimator/model/estimate.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// By how much of itself the signal of an estimate is low where a detector's inputs share the light
// unevenly; 0 where the photons of each input are not known. DeadIntervals takes each detection to
// hide the mean share of the light, but the input that gets more sees its photon earlier in the
// pulse, and counts one where several came. The first alone makes S^2 V / 12, V = sum f^3 -
// (sum f^2)^2 over the shares f. For both 2.4 times that is taken: up to one photon a pulse two
// thirds to all of it, of three photons a third (docs/evidence/data/dead-time-split.csv).
double low_by_split(const FrameView& frame, const Estimate& estimate, const PulseTrain& train);

}  // namespace splid
