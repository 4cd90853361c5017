#pragma once

#include <string>

#include "daemon/study/calibration/pattern_calibration.hpp"
#include "daemon/study/svg_chart.hpp"

namespace splid {

// What a calibration found, for people. Threads: any. Errors: none.

// Each pulse of the pattern with its standard deviations, a line each.
std::string calibration_table(const Pattern& pattern);

// What was used, how the target kept still, and what to write into the configuration for it.
// pattern_file: where the pattern is; length_ms: of a frame.
std::string calibration_summary(const PatternCalibration& calibrated,
                                const std::string& pattern_file, double length_ms);

// All pulses laid upon each other with the shape through them, and a gaussian of sigma_ps beside
// it; below once more with a logarithmic axis, where a tail shows.
Chart calibration_chart(const PatternCalibration& calibrated, const CalibrationPlan& plan,
                        double sigma_ps);

}  // namespace splid
