#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/base/log.hpp"
#include "daemon/base/progress.hpp"
#include "daemon/base/write_file.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/draw_plot.hpp"
#include "daemon/commands/number_check.hpp"
#include "daemon/commands/output_check.hpp"
#include "daemon/recording/recording_facts.hpp"
#include "daemon/service/stop_signals.hpp"
#include "daemon/study/calibration/calibration_report.hpp"
#include "daemon/study/calibration/pattern_calibration.hpp"
#include "drivers/replay/recording_info.hpp"
#include "protocol/error.hpp"
#include "protocol/json_writer.hpp"
#include "protocol/pattern_json.hpp"
#include "protocol/shown_text.hpp"

namespace splid {
namespace {

struct CalibrateCommand {
  calibration::Plan plan;
  std::string config;
  std::string output;
  std::string csv;
  std::string plot;
  double amplitude_percent = 2;
  bool force = false;
};

void check_output(const CalibrateCommand& options) {
  for (const std::string& file : {options.output, options.csv, options.plot}) check_folder_of(file);
  check_may_write(options.output, options.force);
}

void check_inputs_stay(const Config& config, const CalibrateCommand& options) {
  OutputCheck outputs(config);
  outputs.add_input("the recording", options.plan.recording);
  outputs.check("--csv", options.csv);
  outputs.check("--plot", options.plot);
  outputs.may_replace("/pattern/file");  // replaced by its calibration
  outputs.check("--output", options.output);
}

calibration::PatternCalibration calibrate_shown(const Config& config, const calibration::Plan& plan,
                                                const std::stop_token& stop) {
  Progress progress(host_clock());
  const auto show = [&](const char* doing, double seconds) {
    if (progress.due())
      progress.show(plan.recording + ": " + doing + fmt::format(", {:.1f} s", seconds));
  };
  return calibration::calibrate_recording(config, plan.recording, plan, show, stop);
}

// The photons as a table, and its picture, as far as they are asked for.
void write_pictures(const CalibrateCommand& options,
                    const calibration::PatternCalibration& calibrated, double sigma_ps) {
  if (options.csv.empty()) return;
  write_file(options.csv, calibration::photon_density_csv(calibrated));
  log_info("the photons of the pulses are in {}", options.csv);
  if (options.plot.empty()) return;
  draw_plot({"calibration", options.output, options.csv, number_text(sigma_ps), options.plot});
}

int calibrate(CalibrateCommand options) {
  const StopSignals signals;
  if (options.csv.empty() && !options.plot.empty()) options.csv = table_of_plot(options.plot);
  options.plan.goal.std_amplitude = options.amplitude_percent / 100;
  check_output(options);
  const Config config = load_config_aloud(options.config);
  check_inputs_stay(config, options);
  recording::check_width(config, scan_recording(options.plan.recording, 1).header);
  recording::warn_of_other_pattern(config, options.plan.recording);
  const calibration::PatternCalibration calibrated =
      calibrate_shown(config, options.plan, signals.token());
  write_file(options.output, to_json_file(calibrated.pattern));
  write_pictures(options, calibrated, config.pulse.sigma_ps);
  std::fputs(calibration::pulse_table(calibrated.pattern).c_str(), stdout);
  std::fputs(shown_lines(calibration::summary(calibrated, shown_text(options.output, most_said),
                                              config.frame.length_ms))
                 .c_str(),
             stderr);
  return 0;
}

void add_options(CLI::App& command, CalibrateCommand& options) {
  command.add_option("recording", options.plan.recording, "Recording, T2 mode")->required();
  command
      .add_option("--config,-c", options.config,
                  "Configuration: channels, nominal pattern, pulse width")
      ->required();
  command.add_option("--output,-o", options.output, "Pattern file to write")->required();
  command
      .add_option("--distance-m", options.plan.distance_m,
                  "Distance of the target, m (default: the middle of the range)")
      ->check(number_between(-calibration::farthest_target_m, calibration::farthest_target_m));
  command
      .add_option(
          "--time-ps", options.plan.goal.std_time_ps,
          "Required standard deviation of each pulse time, and largest motion of the target, ps")
      ->check(number_above_zero())
      ->capture_default_str();
  command
      .add_option("--amplitude-percent", options.amplitude_percent,
                  "Required standard deviation of each amplitude, percent of the mean amplitude")
      ->check(number_above_zero())
      ->capture_default_str();
  command.add_option("--csv", options.csv,
                     "Text file for the superposed photons of all pulses (default with --plot: its "
                     "name with .csv)");
  command.add_option("--plot", options.plot,
                     "Picture of the pulse to write: .svg, .png or .pdf; needs Python");
  command.add_flag("--force", options.force, "Overwrite an existing file");
}

}  // namespace

void add_calibrate(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "calibrate", "Find the pulses of a pattern in a recording of a target at rest");
  const auto options = std::make_shared<CalibrateCommand>();
  add_options(*command, *options);
  add_log_options(*command);
  command->callback([&action, options] { action = [options] { return calibrate(*options); }; });
}

}  // namespace splid
