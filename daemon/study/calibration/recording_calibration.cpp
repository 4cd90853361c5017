#include "daemon/study/calibration/recording_calibration.hpp"

#include <spdlog/spdlog.h>

#include "drivers/replay/replay.hpp"

namespace splid {

PatternCalibration calibrate_recording(const Config& config, const std::string& file,
                                       const CalibrationPlan& plan,
                                       const CalibrationProgress& progress,
                                       const std::stop_token& stop) {
  SourceContext context;
  context.pattern = &config.pattern;
  context.warn = [](const std::string& sentence) { spdlog::warn("{}", sentence); };
  ReplayOptions replay;
  replay.recording = file;
  return calibrate_pattern(
      config, [&] { return replay.open(context); }, plan, progress, stop);
}

}  // namespace splid
