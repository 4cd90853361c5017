#pragma once

#include <string>
#include <vector>

#include "estimator/calibration/calibration.hpp"
#include "estimator/calibration/input_shift.hpp"

namespace splid {

// An input of a detector that is split over several, and what the first one's pulses say of it.
struct InputDelay {
  std::string input;
  double configured_ps = 0;  // taken off its times already
  InputShift shift;          // what is left: later than the first input
};

// Whether any of them is late, or early, by more than chance and a twentieth of the pulse's width.
bool are_apart(const std::vector<InputDelay>& inputs, double width_ps);

// By how much each input is off the first, and the configuration's line that mends it; empty where
// none is apart.
std::string describe_input_delays(const std::vector<InputDelay>& inputs, double width_ps);

}  // namespace splid
