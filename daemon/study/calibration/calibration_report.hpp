#pragma once

#include <string>
#include <vector>

#include "daemon/study/calibration/pattern_calibration.hpp"

namespace splid::calibration {

// The result of a calibration, for people. Threads: any. Errors: none.

// A table with a line for each pulse of the pattern: its values and their standard deviations.
std::string pulse_table(const Pattern& pattern);

// The photons that were used, how still the target was, and the configuration lines for the new
// pattern. pattern_file: the file of the new pattern; length_ms: of a frame.
std::string summary(const PatternCalibration& calibrated, const std::string& pattern_file,
                    double length_ms);

// The photons of all pulses laid upon each other, by their offset from the time of their pulse,
// less background and neighbouring pulses: as a density whose integral is 1, with its noise of one
// standard deviation. All have the same length.
struct PhotonDensity {
  std::vector<double> offset_ps;
  std::vector<double> density_per_ns;
  std::vector<double> std_per_ns;
};
PhotonDensity photon_density(const PatternCalibration& calibrated);

// The same as a table of comma-separated values, with a line of the columns' names.
std::string photon_density_csv(const PatternCalibration& calibrated);

}  // namespace splid::calibration
