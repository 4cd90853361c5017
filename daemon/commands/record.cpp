
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <span>
#include <string>

#include "config/config.hpp"
#include "daemon/base/log.hpp"
#include "daemon/base/write_file.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/output_check.hpp"
#include "daemon/recording/encoder_log.hpp"
#include "daemon/recording/record_source.hpp"
#include "daemon/recording/table_head.hpp"
#include "daemon/service/measured_copy.hpp"
#include "daemon/service/stop_signals.hpp"
#include "daemon/stream/open_source.hpp"

namespace splid {
namespace {

struct RecordCommand {
  std::string config;
  std::string output;
  bool force = false;
};

void check_output(const Config& config, const std::string& output) {
  const OutputCheck outputs(config);
  outputs.check("--output", output);
  outputs.check("--output with its counts", encoder_file_of(output));
  for (const std::string& table : recording::table_files_beside(output)) {
    outputs.check("--output with its frames", table);
  }
}

// Null where the frames are not kept. Errors: Error(Fault::usage) where a table is there already
// and may not be overwritten.
std::unique_ptr<MeasuredCopy> keep_frames(const Config& config, const SourceInfo& source,
                                          const RecordCommand& options) {
  if (config.record.frames == RecordFrames::off) return nullptr;
  const std::string table = recording::table_beside(options.output, config.record.frames);
  check_may_write(table, options.force);
  std::remove(table.c_str());
  return std::make_unique<MeasuredCopy>(config, source, options.output);
}

int record(const RecordCommand& options) {
  const StopSignals signals;
  const Config config = load_config_aloud(options.config);
  check_output(config, options.output);
  const std::unique_ptr<TagSource> source = open_source(config);
  log_info("source {}; recording into {}", source->info().name, options.output);
  const std::unique_ptr<MeasuredCopy> frames = keep_frames(config, source->info(), options);
  recording::Limit limit;
  if (frames) limit.see = [&frames](std::span<const Tag> tags) { frames->take(tags); };
  const recording::RecordSummary summary = recording::record_source(
      config, *source, options.output, options.force, host_clock(), signals.token(), limit);
  log_info(in_words(summary, options.output));
  if (frames) log_info(frames->finish({}));
  return 0;
}

}  // namespace

void add_record(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("record", "Write the source's tags to a PTU recording");
  const auto options = std::make_shared<RecordCommand>();
  command->add_option("--config,-c", options->config, "Configuration file")->required();
  command->add_option("--output,-o", options->output, "PTU file to write")->required();
  command->add_flag("--force", options->force, "Overwrite an existing file");
  add_log_options(*command);
  command->callback([&action, options] { action = [options] { return record(*options); }; });
}

}  // namespace splid
