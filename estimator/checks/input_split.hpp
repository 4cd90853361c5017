#pragma once

#include "estimator/model/estimate.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// What bright pulses do to the signal where a detector's inputs share the light unevenly.
// DeadIntervals takes each detection to hide the mean share of the light. But the input that gets
// more sees its photon earlier in the pulse, when more of the pulse's light is still to come, and
// the counts say the shares f less well, as it counts one photon where several came. The first of
// the two alone makes the signal low by S^2 V / 12 of itself, to the second order in S, with V =
// sum f^3 - (sum f^2)^2. For both, 2.4 times that is taken. It is a measure to warn by: up to one
// photon a pulse it says two thirds to all of what the signal is low by, and of three photons a
// third, as their counts understate V too (docs/evidence/data/dead-time-split.csv).
//
// By how much of itself the signal of an estimate of this frame is low; 0 where the photons of each
// input are not known.
double low_by_split(const FrameView& frame, const Estimate& estimate, const PulseTrain& train);

}  // namespace splid
