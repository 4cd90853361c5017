#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "config/config.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/format.hpp"
#include "daemon/log_level.hpp"
#include "daemon/pattern_calibration.hpp"
#include "daemon/read_file.hpp"
#include "daemon/session.hpp"
#include "daemon/stop_signals.hpp"
#include "drivers/replay/replay.hpp"
#include "protocol/error.hpp"
#include "protocol/pattern_json.hpp"

namespace splid {
namespace {

struct CalibrateCommand {
  std::string recording;
  std::string config;
  std::string output;
  bool force = false;
};

void print_pulses(const Pattern& pattern) {
  const PatternSegment& segment = pattern.segments.front();
  std::printf("%5s  %14s  %9s\n", "pulse", "time ps", "amplitude");
  for (std::size_t p = 0; p < segment.pulse_times_ps.size(); ++p) {
    std::printf("%5zu  %14.2f  %9.4f\n", p, segment.pulse_times_ps[p], segment.amplitudes[p]);
  }
}

int calibrate(const CalibrateCommand& options) {
  const StopSignals signals;
  Config config = load_config(options.config);
  auto replay = std::make_unique<ReplayOptions>();
  replay->recording = options.recording;
  config.source = std::move(replay);
  config.source_driver = "replay";
  check_may_write(options.output, options.force);
  const std::unique_ptr<TagSource> source = open_source(config);
  const Pattern pattern = calibrate_pattern(config, *source, options.recording, signals.token());
  if (signals.token().stop_requested()) {
    throw Error(Fault::usage, "stopped; " + options.output + " was not written");
  }
  write_file(options.output, to_json_file(pattern));
  print_pulses(pattern);
  std::fprintf(stderr, "%s: %s; calibrated period %.6f ps\n", options.output.c_str(),
               describe_pattern(pattern).c_str(), *pattern.calibrated_period_ps);
  return 0;
}

}  // namespace

void add_calibrate(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("calibrate", "Find a pattern's pulses in a static target's recording");
  const auto options = std::make_shared<CalibrateCommand>();
  command->add_option("recording", options->recording, "PTU file, T2 mode")->required();
  command
      ->add_option("--config,-c", options->config,
                   "Configuration: channels, nominal pattern, pulse width")
      ->required();
  command->add_option("--output,-o", options->output, "Pattern file to write")->required();
  command->add_flag("--force", options->force, "Write over an existing file");
  add_log_options(*command);
  command->callback([&action, options] { action = [options] { return calibrate(*options); }; });
}

}  // namespace splid
