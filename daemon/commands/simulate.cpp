
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "config/config.hpp"
#include "daemon/base/log.hpp"
#include "daemon/base/write_file.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/number_check.hpp"
#include "daemon/commands/output_check.hpp"
#include "daemon/recording/encoder_log.hpp"
#include "daemon/recording/record_source.hpp"
#include "daemon/service/stop_signals.hpp"
#include "daemon/stream/open_source.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

constexpr double most_seconds = 4e6;  // as /source/seconds of a scene

struct SimulateCommand {
  std::string config;
  std::string output;
  double seconds = 0;
  bool force = false;
};

std::string truth_file(const std::string& recording) {
  return std::filesystem::path(recording).replace_extension(".truth.json").string();
}

simulator::Options& scene_of(Config& config) {
  auto* scene = dynamic_cast<simulator::Options*>(config.source.get());
  if (scene != nullptr) return *scene;
  throw Error(Fault::usage, config.file + ": /source/driver is \"" + config.source_driver +
                                "\"; simulate needs a scene: the driver \"simulator\"");
}

void check_outputs(const Config& config, const SimulateCommand& options) {
  const OutputCheck outputs(config);
  const std::string truth = truth_file(options.output);
  outputs.check("--output", options.output);
  outputs.check("--output with its truth", truth);
  outputs.check("--output with its counts", encoder_file_of(options.output));
  check_may_write(truth, options.force);
}

int simulate(const SimulateCommand& options) {
  const StopSignals signals;
  Config config = load_config_aloud(options.config);
  simulator::Options& scene = scene_of(config);
  scene.pace = simulator::Speed::max;
  scene.seconds = options.seconds;
  check_outputs(config, options);
  scene.truth = truth_file(options.output);
  const std::unique_ptr<TagSource> source = open_source(config);
  const recording::RecordSummary summary = recording::record_source(
      config, *source, options.output, options.force, host_clock(), signals.token());
  log_info("{}; the truth is in {}", in_words(summary, options.output), scene.truth);
  return 0;
}

}  // namespace

void add_simulate(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "simulate", "Write the configured scene as a PTU recording, and its truth");
  const auto options = std::make_shared<SimulateCommand>();
  command->add_option("--config,-c", options->config, "Configuration file, driver simulator")
      ->required();
  command->add_option("--seconds,-s", options->seconds, "Length of the stream")
      ->required()
      ->check(number_above_zero(most_seconds));
  command
      ->add_option("--output,-o", options->output,
                   "PTU file to write; the truth goes beside it, ending in .truth.json")
      ->required();
  command->add_flag("--force", options->force, "Overwrite an existing file");
  add_log_options(*command);
  command->callback([&action, options] { action = [options] { return simulate(*options); }; });
}

}  // namespace splid
