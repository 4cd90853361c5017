#pragma once

#include <string>

#include "daemon/study/calibration/pattern_calibration.hpp"
#include "daemon/study/svg_chart.hpp"

namespace splid {

// The result of a calibration, for people. Threads: any. Errors: none.

// A table with a line for each pulse of the pattern: its values and their standard deviations.
std::string calibration_table(const Pattern& pattern);

// The photons that were used, how still the target was, and the configuration lines for the new
// pattern. pattern_file: the file of the new pattern; length_ms: of a frame.
std::string calibration_summary(const PatternCalibration& calibrated,
                                const std::string& pattern_file, double length_ms);

// A chart of all pulses laid upon each other, with the fitted shape and, for comparison, a gaussian
// of sigma_ps; a second panel shows the same on a logarithmic axis, where a tail can be seen.
Chart calibration_chart(const PatternCalibration& calibrated, const CalibrationPlan& plan,
                        double sigma_ps);

}  // namespace splid
