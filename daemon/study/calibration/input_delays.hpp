#pragma once

#include <string>
#include <vector>

#include "estimator/calibration/calibration.hpp"

namespace splid::calibration {

// One of several inputs of a detector, and how much later its pulses come than those of the first
// input.
struct InputDelay {
  std::string input;
  double configured_ps = 0;  // the configured delay, already subtracted from the input's times
  InputShift shift;          // how much later it still is than the first input
};

// Whether any input is late or early by more than chance and by more than a twentieth of the
// pulse's width.
bool are_apart(const std::vector<InputDelay>& inputs, double width_ps);

// How far each input is off the first input, and the configuration line that corrects it; empty
// where are_apart() is false.
std::string describe_input_delays(const std::vector<InputDelay>& inputs, double width_ps);

}  // namespace splid::calibration
