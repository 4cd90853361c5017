#pragma once

#include "estimator/paper/harmonic_power.hpp"

namespace splid::paper {

// The rate n * step with the largest power, |n| <= steps: the lowest where several are equal. step:
// by it, the ends of the train move by one bin of the power.
//
// Of many rates, most are ruled out by a coarse power. It is taken for 32 rates at a time, from
// 32 slices of the frame that are folded at a rate amid these and added up along lines, by a
// TaylorTree. This rounds photons to whole bins, and errs by a third of the noise. All rates whose
// coarse power is near the largest are then tried by the power itself: within 1.5 standard
// deviations of the coarse powers, or a quarter of what the largest is above their mean. That is
// one rate where there is a target, and 1.5 % of all where there is none. The answer is then the
// one of all rates, except in a frame in hundreds without a target, which has another peak of the
// noise.
double best_rate(HarmonicPower& power, double step, int steps);

}  // namespace splid::paper
