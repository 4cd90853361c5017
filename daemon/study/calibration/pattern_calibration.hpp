#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "daemon/study/calibration/input_delays.hpp"
#include "drivers/source.hpp"
#include "estimator/calibration/calibration.hpp"
#include "estimator/calibration/phase_histogram.hpp"
#include "estimator/calibration/rest_check.hpp"
#include "protocol/pattern.hpp"

namespace splid {

struct CalibrationPlan {
  std::string recording;             // its name
  CalibrationGoal goal;              // the time is also the most that the target may have moved
  std::optional<double> distance_m;  // that the target is at: what `run` is to read for it
};

struct PatternCalibration {
  Pattern pattern;  // to be written
  Calibration calibration;
  RestReport rest;
  PhaseHistogram fold;
  std::vector<InputDelay> inputs;  // of a detector on several; empty: one, or they do not agree
};

// A source of the same tags each time.
using OpenRecording = std::function<std::unique_ptr<TagSource>()>;
// Called once a frame: what is done, and how many seconds of the recording are through.
using CalibrationProgress = std::function<void(const char* doing, double seconds)>;

// The pattern that a recording of a static target shows: the period from the syncs, pulse times,
// amplitudes and shape from the photons folded on it. The recording is read twice: to be folded,
// and to see frame by frame whether the target was at rest.
//
// Its times hold the target's own delay, so distances measured with it are relative to that target
// unless its distance is given. The configured pattern gives the nominal period; mode and range are
// kept where the recording has as many pulses, otherwise the pattern is baseline (one pulse) or
// random (several). Where delays stay alike that divide its range (of an even comb, or a nearly
// even one at this light in a frame of the configured length), it is ambiguous, with the range that
// is left. Of several inputs each one's pulses are looked for too, which reads the recording once
// more for each. The configured pulse width (pulse.sigma_ps) need hold within a factor of two.
//
// Threads: the caller's. Errors: the source's; Error(Fault::usage) for a pattern of several
// segments and after a stop request; Error(Fault::data) where the syncs do not fit the nominal
// period, no pulse stands out, the target moved (with its velocity) or the photons are too few
// (with how many it needs), saying what was seen.
PatternCalibration calibrate_pattern(const Config& config, const OpenRecording& open,
                                     const CalibrationPlan& plan,
                                     const CalibrationProgress& progress,
                                     const std::stop_token& stop);

}  // namespace splid
