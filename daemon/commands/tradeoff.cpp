#include "daemon/tradeoff/tradeoff.hpp"

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "daemon/clock.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/format.hpp"
#include "daemon/line_writer.hpp"
#include "daemon/log_level.hpp"
#include "daemon/progress.hpp"
#include "daemon/read_file.hpp"
#include "daemon/service/stop_signals.hpp"
#include "daemon/tradeoff/tradeoff_choice.hpp"
#include "daemon/tradeoff/tradeoff_report.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

struct TradeoffCommand {
  std::string config;
  std::string recording;
  std::vector<double> lengths_ms;
  std::size_t frames = 200;
  std::optional<std::int64_t> seed;
  std::optional<double> budget_ms;
  bool json = false;
  std::string csv;
  std::string plot = "tradeoff.svg";
};

// "exhaustive, frames of 50 ms: 17 of 201; 43 %, 12 s left".
std::string progress_text(const std::string& doing, double done, double took_s) {
  std::string text = doing + format("; %.0f %%", 100 * done);
  // Before a twentieth is done the rest is a guess.
  if (done > 0.05) text += format(", %.0f s left", took_s * (1 - done) / done);
  return text;
}

std::vector<TradeoffRow> measure(const Config& config, const FrameOrigin& origin,
                                 const TradeoffCommand& options, const std::stop_token& stop) {
  Progress progress(host_clock());
  const std::int64_t begin_ns = host_clock().steady_ns();
  TradeoffEvents events;
  events.warn = [](const std::string& sentence) { spdlog::warn("{}", sentence); };
  events.progress = [&](const std::string& doing, double done) {
    if (!progress.due()) return;
    const double took_s = static_cast<double>(host_clock().steady_ns() - begin_ns) / 1e9;
    progress.show(progress_text(doing, done, took_s));
  };
  const TradeoffPlan plan{possible_lengths_ms(config, origin, options.lengths_ms, events.warn),
                          options.frames};
  return measure_tradeoff(config, origin, plan, thread_cpu_ms, events, stop);
}

void write_files(const TradeoffCommand& options, const TradeoffReport& report) {
  if (!options.csv.empty()) {
    write_file(options.csv, tradeoff_csv(report));
    spdlog::info("the table is in {}", options.csv);
  }
  write_file(options.plot, to_svg(tradeoff_chart(report)));
  spdlog::info("the plot is in {}", options.plot);
}

// Without the line feed, which the writer adds.
void print(const std::string& text) {
  LineWriter(stdout, "standard output").write(text.substr(0, text.size() - 1));
}

int tradeoff(const TradeoffCommand& options) {
  const StopSignals signals;
  for (const std::string& file : {options.csv, options.plot}) check_folder_of(file);
  const Config config = load_config(options.config);
  FrameOrigin origin = find_origin(config, options.recording);
  if (origin.scene && options.seed) origin.scene->seed = *options.seed;
  spdlog::info("frames of {}; {}", origin.name, tradeoff_title(config, origin));
  const auto rows = measure(config, origin, options, signals.token());
  if (rows.empty()) throw Error(Fault::usage, "stopped before anything was measured");
  if (signals.token().stop_requested()) spdlog::warn("stopped: this is what was measured so far");
  const TradeoffReport report{rows, errors_against(origin), tradeoff_title(config, origin),
                              config.estimator, options.budget_ms};
  const std::string advice = tradeoff_advice(report, config.frame.length_ms);
  if (options.json) {
    print(tradeoff_json(report));
    std::fputs(advice.c_str(), stderr);
  } else {
    print(tradeoff_table(report) + advice);
  }
  write_files(options, report);
  if (options.budget_ms && !find_within_budget(rows, *options.budget_ms)) {
    throw Error(Fault::data,
                format("no setting is done within %g ms in 99 of 100 frames", *options.budget_ms));
  }
  return 0;
}

void add_options(CLI::App& command, TradeoffCommand& options) {
  command
      .add_option("--config,-c", options.config, "Configuration: the scene, or how to read FILE")
      ->required();
  command.add_option("recording", options.recording,
                     "PTU file, T2 mode, to take the frames from; default: the configured scene");
  command
      .add_option("--lengths", options.lengths_ms,
                  "Frame lengths, ms, such as 10,50 (default: four around the configured one)")
      ->delimiter(',')
      ->allow_extra_args(false)  // or it would take the recording for another length
      ->check(CLI::Range(0.1, 60000.0));
  command.add_option("--frames,-n", options.frames, "Frames that each setting is measured on")
      ->check(CLI::Range(std::size_t{10}, std::size_t{1'000'000}))
      ->capture_default_str();
  command.add_option("--seed", options.seed, "Of the scene, instead of the configured one")
      ->check(CLI::NonNegativeNumber);
  command
      .add_option("--budget-ms", options.budget_ms,
                  "Say which setting is the most accurate that takes no longer a frame")
      ->check(CLI::PositiveNumber);
  command.add_flag("--json", options.json, "Each setting as a line of JSON on standard output");
  command.add_option("--csv", options.csv, "Write the table to this file too");
  command.add_option("--plot", options.plot, "SVG file to draw the curve in")
      ->capture_default_str();
}

}  // namespace

void add_tradeoff(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "tradeoff", "Measure speed against accuracy for the configured scene or a recording");
  const auto options = std::make_shared<TradeoffCommand>();
  add_options(*command, *options);
  add_log_options(*command);
  command->callback([&action, options] { action = [options] { return tradeoff(*options); }; });
}

}  // namespace splid
