#pragma once

#include <optional>

#include "estimator/calibration/calibration.hpp"

namespace splid {

// How one input of a detector sees the pulses of another.
struct InputShift {
  double shift_ps = 0;  // its pulses come so much later, in half a pattern period about 0
  double std_ps = 0;
  double rms_ps = 0;  // what is left between pulses then
};

// The shift by which the second one's pulses fall on the first one's best: absent where they are
// not as many, or where those of no shift fall on one another, to within a fifth of a pulse width
// or five of their own deviations. Among shifts that are as good (of an even comb) the smallest.
//
// Threads: any. Errors: none.
std::optional<InputShift> shift_between(const Calibration& first, const Calibration& second);

}  // namespace splid
