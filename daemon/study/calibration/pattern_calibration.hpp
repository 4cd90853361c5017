#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "daemon/study/calibration/crosstalk.hpp"
#include "daemon/study/calibration/input_delays.hpp"
#include "daemon/study/calibration/pixel_report.hpp"
#include "drivers/source.hpp"
#include "estimator/calibration/calibration.hpp"
#include "estimator/calibration/phase_histogram.hpp"
#include "estimator/calibration/rest_check.hpp"
#include "protocol/pattern.hpp"

namespace splid::calibration {

// The room daemon/study/calibration finds a pattern from a recording. Read this header first.

inline constexpr double farthest_target_m = 1e6;

struct Plan {
  std::string recording;             // its name, for people
  Goal goal;                         // the target may move by at most the goal's time
  std::optional<double> distance_m;  // of the target, as `splid run` shall show it, up to
                                     // farthest_target_m either way
};

struct PatternCalibration {
  Pattern pattern;      // the calibrated pattern, to be written to a file
  double target_m = 0;  // what the target of the recording reads with this pattern
  Calibration calibration;
  RestReport rest;
  PhaseHistogram fold;
  std::vector<InputDelay> inputs;         // empty: a single input, or inputs that do not agree
  std::vector<PixelReport> pixels = {};   // of several pixels; the pattern is that of the first
  std::vector<Crosstalk> crosstalk = {};  // between the pixels
};

// Opens a source that gives the same tags each time.
using OpenRecording = std::function<std::unique_ptr<TagSource>()>;
// Called once for each frame: what is being done, and how many seconds of the recording are read.
using TellProgress = std::function<void(const char* doing, double seconds)>;

// Finds the pattern from a recording of a target at rest: the period from the syncs, and the pulse
// times, amplitudes and shape from the photons folded at that period. The recording is read twice:
// once to fold it, and once to see frame by frame whether the target was at rest.
//
// Where the target's distance is not given, the pulse times are such that the target reads the
// middle of the range, where noise does not wrap it. The configured pattern gives the nominal
// period. Its mode and range are kept if the recording has as many pulses; otherwise the new
// pattern is baseline (one pulse) or random (several pulses). If delays that divide the range
// cannot be told apart (because the pulses are evenly spaced, or nearly so for the light in a frame
// of the configured length), the pattern gets the mode ambiguous and the smaller range that is
// left. If there are several inputs, the pulses of each input are looked for as well, which reads
// the recording once more for each input. Of several pixels the first gives the pattern, and each
// is compared with it, and a last reading looks for crosstalk between them. The configured pulse
// width (pulse.sigma_ps) need only hold within a factor of two.
//
// Threads: the caller's. Errors: the source's; Error(Fault::usage) for a pattern of several
// segments, a target too far away and after a stop request; Error(Fault::data), which says what was
// seen, where the syncs do not fit the nominal period, no pulse stands out, the target moved (with
// its velocity) or the photons are too few (with how many are needed).
PatternCalibration calibrate_pattern(const Config& config, const OpenRecording& open,
                                     const Plan& plan, const TellProgress& progress,
                                     const std::stop_token& stop);

// calibrate_pattern() of a PTU file; the configured source is not looked at.
//
// Threads, Errors: as calibrate_pattern(), with those of the replay driver.
PatternCalibration calibrate_recording(const Config& config, const std::string& file,
                                       const Plan& plan, const TellProgress& progress,
                                       const std::stop_token& stop);

}  // namespace splid::calibration
