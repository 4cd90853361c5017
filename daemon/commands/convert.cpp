
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "daemon/base/log.hpp"
#include "daemon/base/text.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/recording/convert_recording.hpp"
#include "daemon/recording/loss_words.hpp"
#include "daemon/service/stop_signals.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

struct ConvertCommand {
  std::string recording;
  std::string output;
  bool force = false;
};

int convert(const ConvertCommand& options) {
  std::error_code absent;
  if (std::filesystem::equivalent(options.recording, options.output, absent)) {
    throw Error(Fault::usage, options.output +
                                  ": is the recording itself, which would be overwritten while it "
                                  "is read; give the new file another name");
  }
  if (!options.output.ends_with(".ptu")) {
    throw Error(Fault::usage, options.output + ": convert writes a PTU; end its name in .ptu");
  }
  const StopSignals signals;
  const recording::ConvertSummary summary = recording::convert(
      options.recording, options.output, options.force, host_clock(), signals.token());
  if (summary.stopped) {
    log_warning("stopped; {} was not written", options.output);
    return stopped_exit_code;
  }
  log_info("{} records in {}, {} mode, {}", grouped(summary.records), options.output,
           summary.is_t3 ? "T3" : "T2",
           recording::lost_in_words(summary.lost_tags, summary.uncounted_losses));
  return 0;
}

}  // namespace

void add_convert(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("convert", "Convert a recording of another format to PTU");
  const auto options = std::make_shared<ConvertCommand>();
  command->add_option("recording", options->recording, "Recording in any format that splid reads")
      ->required();
  command->add_option("output,--output,-o", options->output, "PTU file to write")->required();
  command->add_flag("--force", options->force, "Overwrite an existing file");
  add_log_options(*command);
  command->callback([&action, options] { action = [options] { return convert(*options); }; });
}

}  // namespace splid
