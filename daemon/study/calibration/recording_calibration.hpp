#pragma once

#include <stop_token>
#include <string>

#include "config/config.hpp"
#include "daemon/study/calibration/pattern_calibration.hpp"

namespace splid {

// calibrate_pattern() of a PTU file. config: whose source is not looked at.
//
// Threads, Errors: as calibrate_pattern(); the replay driver's too.
PatternCalibration calibrate_recording(const Config& config, const std::string& file,
                                       const CalibrationPlan& plan,
                                       const CalibrationProgress& progress,
                                       const std::stop_token& stop);

}  // namespace splid
