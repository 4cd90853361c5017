#pragma once

#include <optional>

#include "estimator/calibration/calibration.hpp"

namespace splid::calibration {

// How the pulses of a second input of a detector lie to those of the first.
struct InputShift {
  double shift_ps = 0;  // how much later the second's pulses come; within half a period about 0
  double std_ps = 0;    // one standard deviation of the shift
  double rms_ps = 0;    // distance that is left between the pulses after the shift
};

// The shift that brings the second input's pulses onto those of the first. Absent where the inputs
// do not have the same number of pulses, or where at no shift all pulses fall on one another, to
// within a fifth of a pulse width or five of their own deviations. Of shifts that are equally good,
// as an even comb has them, the smallest is taken.
std::optional<InputShift> shift_between(const Calibration& first, const Calibration& second);

}  // namespace splid::calibration
