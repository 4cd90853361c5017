#pragma once

#include "estimator/paper/harmonic_power.hpp"

namespace splid::paper {

// The rate n * step with the largest power, |n| <= steps: the lowest where several are equal. step:
// by it, the ends of the train move by one bin of the power.
//
// Of many rates, most are ruled out by a coarse power, for 32 rates at a time: 32 slices, folded at
// a rate amid these, are added up along lines by a TaylorTree, in whole bins, which errs by a third
// of the noise. Rates within 1.5 standard deviations of the coarse powers, or a quarter of what the
// largest is above their mean, are tried by the power itself: one where there is a target, 1.5 %
// where there is none. The answer is that of all rates but in a frame in hundreds without a target.
double best_rate(HarmonicPower& power, double step, int steps);

}  // namespace splid::paper
