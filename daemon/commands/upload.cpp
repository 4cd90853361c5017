#include "drivers/awg/upload.hpp"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <stop_token>
#include <string>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/base/log.hpp"
#include "daemon/base/progress.hpp"
#include "daemon/base/text.hpp"
#include "daemon/base/write_file.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/output_check.hpp"
#include "daemon/service/stop_signals.hpp"
#include "drivers/awg/awg_model.hpp"
#include "drivers/awg/waveform_plan.hpp"
#include "protocol/pattern_json.hpp"

namespace splid {
namespace {

struct UploadCommand {
  std::string config;
  std::string output;
  bool force = false;
  bool dry_run = false;
  bool stop = false;
};

void keep(const Pattern& played, const std::string& output) {
  if (output.empty()) return;
  write_file(output, to_json_file(played));
  log_info("{}: the pattern as played: {}", output, describe_pattern(played));
}

awg::Uploaded upload_shown(const Config& config, const std::stop_token& stop) {
  Progress line(host_clock());
  return awg::upload(
      config.awg, config.pattern,
      [&](const char* what, double part) {
        if (line.due()) line.show(fmt::format("{}, {:.0f} %", what, 100 * part));
      },
      stop);
}

int run_upload(const UploadCommand& options) {
  const StopSignals signals;
  const Config config = load_config_aloud(options.config);
  if (options.stop) {
    log_info("{}: plays nothing, its output is off; its error queue is empty",
             awg::switch_off(config.awg, signals.token()));
    return 0;
  }
  if (!options.output.empty()) check_may_write(options.output, options.force);
  OutputCheck outputs(config);
  outputs.may_replace("/pattern/file");  // replaced by the pattern as it is played
  outputs.check("--output", options.output);
  const awg::Model& model = awg::models()[config.awg.model];
  const awg::WaveformPlan plan = awg::plan_waveform(config.pattern, model, config.awg);
  log_info("pattern {} ({}) for {}: {}", config.pattern_file, describe_pattern(config.pattern),
           model.name, in_words(plan));
  if (options.dry_run) {
    keep(awg::played_pattern(config.pattern, plan, plan.rate_hz), options.output);
    return 0;
  }
  const awg::Uploaded uploaded = upload_shown(config, signals.token());
  log_info(in_words(uploaded));
  keep(uploaded.played, options.output);
  return 0;
}

}  // namespace

void add_upload(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("upload", "Upload the configured pattern to the waveform generator");
  const auto options = std::make_shared<UploadCommand>();
  command->add_option("--config,-c", options->config, "Configuration file: pattern, awg")
      ->required();
  command->add_option("--output,-o", options->output, "Pattern file to write, as played");
  command->add_flag("--force", options->force, "Overwrite an existing file");
  command->add_flag("--dry-run", options->dry_run,
                    "Show what would be played, without a connection");
  command->add_flag("--stop", options->stop, "Stop playing and switch the output off");
  add_log_options(*command);
  command->callback([&action, options] { action = [options] { return run_upload(*options); }; });
}

}  // namespace splid
