#pragma once

#include <string>
#include <vector>

#include "estimator/calibration/calibration.hpp"

namespace splid::calibration {

// A pixel as a recording of a target at rest shows it.
struct PixelReport {
  std::string name;
  bool has_pulses = false;      // where false, what follows is not known, but for the rate
  double delay_ps = 0;          // for `pixels`: configured, and by how much later than the first
  double std_delay_ps = 0;      // one standard deviation; 0 for the first
  double width_ps = 0;          // of its pulse: for sigma_ps
  double background_per_s = 0;  // its dark counts and the ambient light; all photons without pulses
};

// A table for people; empty without pixels.
std::string describe_pixels(const std::vector<PixelReport>& pixels);

}  // namespace splid::calibration
