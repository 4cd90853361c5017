#include "daemon/study/tradeoff/tradeoff.hpp"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/config.hpp"
#include "config/read_file.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/base/line_writer.hpp"
#include "daemon/base/log.hpp"
#include "daemon/base/progress.hpp"
#include "daemon/base/write_file.hpp"
#include "daemon/batch/batch_list.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/draw_plot.hpp"
#include "daemon/commands/number_check.hpp"
#include "daemon/commands/output_check.hpp"
#include "daemon/recording/recording_facts.hpp"
#include "daemon/service/stop_signals.hpp"
#include "daemon/study/tradeoff/tradeoff_dwell.hpp"
#include "daemon/study/tradeoff/tradeoff_pixel.hpp"
#include "daemon/study/tradeoff/tradeoff_report.hpp"
#include "daemon/study/tradeoff/tradeoff_table.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

struct TradeoffCommand {
  std::string config;
  std::string recording;
  std::string pixel;
  std::vector<double> lengths_ms;
  std::size_t frames = 200;
  std::optional<std::int64_t> seed;
  std::optional<double> budget_ms;
  std::optional<double> velocity_std_mps;
  bool paper = false;
  bool json = false;
  std::string shard;
  std::size_t merge = 0;  // shares whose tables are put together; 0: frames are measured
  std::string csv;
  std::string plot = "tradeoff.svg";
};

// "balanced, frames of 50 ms: 17 of 201; 43 %, 12 s left".
std::string progress_text(const std::string& doing, double done_s, std::optional<double> left_s) {
  if (!left_s) return doing;
  const double share = done_s / std::max(1e-9, done_s + *left_s);
  return doing + fmt::format("; {:.0f} %, {:.0f} s left", 100 * share, *left_s);
}

// Measures, and prints each result as soon as it is known: the lines of the table or, with --json,
// a setting's object when all its members are known, and the table on standard error.
class TradeoffRun {
 public:
  TradeoffRun(const TradeoffCommand& options, const Config& config,
              const tradeoff::FrameOrigin& origin)
      : options_(options), config_(config), origin_(origin), progress_(host_clock()) {
    report_.reference = tradeoff::errors_against(origin);
    report_.configured = config.estimator;
    report_.configured_length_ms = config.frame.length_ms;
    report_.budget_ms = options.budget_ms;
  }

  // Measures the frame lengths of a share. Errors: those of tradeoff::measure();
  // Error(Fault::device) where standard output takes no more.
  const tradeoff::Report& measure(StopSignals& signals, const batch::Shard& shard) {
    signals_ = &signals;
    const tradeoff::Events events = make_events();
    const tradeoff::Plan plan{lengths_of(shard, events.warn), options_.frames, options_.paper};
    if (plan.lengths_ms.empty()) return report_;
    try {
      tradeoff::measure(config_, origin_, plan, {}, events, signals.token());
    } catch (const std::bad_alloc&) {
      throw Error(
          Fault::device,
          fmt::format("not enough memory for {} frames of {:g} ms: lower --frames, --lengths or "
                      "/pipeline/ring_capacity_tags",
                      plan.frames, plan.lengths_ms.back()));
    }
    progress_.clear();
    print_objects();
    return report_;
  }

  // Shows what the shares have measured, as if it were measured now.
  const tradeoff::Report& merge(StopSignals& signals, std::vector<tradeoff::Row> rows) {
    signals_ = &signals;
    const auto length_ms = [](const tradeoff::Row& row) { return row.setting.length_ms; };
    std::stable_sort(rows.begin(), rows.end(), [&](const tradeoff::Row& a, const tradeoff::Row& b) {
      return length_ms(a) < length_ms(b);
    });
    for (std::size_t i = 0; i < rows.size(); ++i) {
      take(rows[i]);
      if (i + 1 < rows.size() && length_ms(rows[i + 1]) == length_ms(rows[i])) continue;
      end_length(length_ms(rows[i]));
    }
    print_objects();
    return report_;
  }

  [[nodiscard]] const tradeoff::Report& report() const { return report_; }

 private:
  // A share measures every N-th of all lengths, so that each share has short and long frames.
  [[nodiscard]] std::vector<double> lengths_of(const batch::Shard& shard,
                                               const tradeoff::Warn& warn) const {
    const std::vector<double> all =
        tradeoff::possible_lengths_ms(config_, origin_, options_.lengths_ms, warn);
    std::vector<double> lengths_ms;
    for (std::size_t i = shard.index - 1; i < all.size(); i += shard.count) {
      lengths_ms.push_back(all[i]);
    }
    return lengths_ms;
  }

  tradeoff::Events make_events() {
    tradeoff::Events events;
    events.warn = [this](const std::string& sentence) {
      progress_.clear();
      log_warning(sentence);
    };
    events.reckoned = [this](std::size_t rows, double seconds) {
      progress_.clear();
      log_info("{} settings to measure: about {} s", rows, std::ceil(seconds));
    };
    events.progress = [this](const std::string& doing, double done_s,
                             std::optional<double> left_s) {
      if (progress_.due()) progress_.show(progress_text(doing, done_s, left_s));
    };
    events.row = [this](const tradeoff::Row& row) { take(row); };
    events.length_done = [this](double length_ms) { end_length(length_ms); };
    return events;
  }

  void take(const tradeoff::Row& row) {
    if (rows_.empty()) print_line(tradeoff::table_head(report_.reference));
    rows_.push_back(row);
    report_.rows = rows_;
    report_.stopped_in_ms = row.setting.length_ms;
    print_line(tradeoff::table_line(row));
  }

  void end_length(double length_ms) {
    report_.stopped_in_ms.reset();
    print_line(tradeoff::knee_line(report_, length_ms));
    if (!options_.budget_ms) print_objects();
  }

  // Prints a line for people: on standard output, or with --json on standard error.
  void print_line(const std::string& line) {
    progress_.clear();
    if (!options_.json) return print(line);
    std::fputs((line + "\n").c_str(), stderr);
  }

  void print_objects() {
    if (!options_.json) return;
    for (; objects_ < rows_.size(); ++objects_) print(tradeoff::row_json(report_, objects_));
  }

  void print(const std::string& line) {
    if (!LineWriter(stdout, "standard output").write(line)) signals_->request_stop();
  }

  const TradeoffCommand& options_;
  const Config& config_;
  const tradeoff::FrameOrigin& origin_;
  Progress progress_;
  StopSignals* signals_ = nullptr;
  std::vector<tradeoff::Row> rows_;
  tradeoff::Report report_;
  std::size_t objects_ = 0;  // how many objects are printed
};

bool knows_an_error(const tradeoff::Report& report) {
  return std::any_of(report.rows.begin(), report.rows.end(), [](const tradeoff::Row& row) {
    return row.distance_rmse_m || row.velocity_rmse_mps;
  });
}

void write_files(const TradeoffCommand& options, const tradeoff::Report& report) {
  write_file(options.csv, tradeoff::to_csv(report));
  log_info("the table is in {}", options.csv);
  if (!knows_an_error(report)) {
    log_warning("{} is not drawn: no setting has a known error", options.plot);
    return;
  }
  draw_plot({"tradeoff", options.csv, options.plot});
}

// "folder/tradeoff-2of4.csv" for the second of four shares.
std::string table_of_share(const std::string& csv, const batch::Shard& shard) {
  const std::filesystem::path file = csv;
  const std::string name = file.stem().string() + "-" + std::to_string(shard.index) + "of" +
                           std::to_string(shard.count) + file.extension().string();
  return (file.parent_path() / name).string();
}

std::vector<tradeoff::Row> rows_of_shares(const TradeoffCommand& options,
                                          const tradeoff::Report& report) {
  std::vector<tradeoff::Row> rows;
  for (std::size_t index = 1; index <= options.merge; ++index) {
    const std::string file = table_of_share(options.csv, {index, options.merge});
    const auto more = tradeoff::rows_of_csv(read_file(file, "--merge: "), file, report);
    rows.insert(rows.end(), more.begin(), more.end());
  }
  if (rows.empty()) throw Error(Fault::data, "--merge: no share has measured anything");
  return rows;
}

// What a share has measured goes into a table of its own, and everything else waits for the merge.
int finish_share(const TradeoffCommand& options, const tradeoff::Report& report,
                 const batch::Shard& shard) {
  if (report.rows.empty()) log_info("no frame length is left for share {}", options.shard);
  write_file(options.csv, tradeoff::to_csv(report));
  log_info("the share's table is in {}; the same command with --merge {} puts all together",
           options.csv, shard.count);
  return 0;
}

int finish(const TradeoffCommand& options, const tradeoff::Report& report) {
  const std::string advice = tradeoff::advice(report);
  std::fputs(advice.c_str(), options.json ? stderr : stdout);
  std::fflush(stdout);
  write_files(options, report);
  if (options.budget_ms && !tradeoff::chosen_row(report)) {
    throw Error(Fault::data, tradeoff::no_choice_reason(report));
  }
  return 0;
}

Config one_pixel(Config config, std::string name) {
  const std::size_t pixels = config.pixels.size();
  if (name.empty() && pixels > 0) name = config.pixels.front().name;
  Config one = tradeoff::config_of_pixel(std::move(config), name);
  const std::size_t around = one.channels.photon.size() - 1;
  const std::string more = around > 0 ? fmt::format(", and of {} around it", around) : "";
  if (pixels > 1) log_info("photons of pixel {} of {}{}", name, pixels, more);
  return one;
}

// How much light comes back. Errors: Error(Fault::usage) where nothing tells it.
tradeoff::DwellLight light_of(const Config& config, const tradeoff::FrameOrigin& origin) {
  if (origin.truth) return tradeoff::light_of(*origin.truth);
  throw Error(Fault::usage,
              "--velocity-std: " + origin.name +
                  " has no FILE.truth.json with its signal; leave the recording out, and write the "
                  "signal and background that splid replay found into " +
                  config.file + ": source.signal_per_pulse and ambient_per_s of the simulator");
}

// "12.3 ms", or that no dwell does.
std::string dwell_in_words(const std::optional<double>& dwell_ms) {
  return dwell_ms ? fmt::format("{:.3g} ms", *dwell_ms) : "more than 60 s";
}

// Says how long a scan's dwells have to be. Nothing is measured.
int tell_dwell(const Config& config, const std::optional<ScanLines>& scan,
               const tradeoff::FrameOrigin& origin, double std_mps) {
  constexpr std::size_t pooled_pixels = 9;
  const tradeoff::DwellLight light = light_of(config, origin);
  const auto one = tradeoff::dwell_ms(config, light, std_mps, 1);
  const auto pooled = tradeoff::dwell_ms(config, light, std_mps, pooled_pixels);
  fmt::print(
      "a standard deviation of the velocity of {:g} m/s needs dwells of {}, at {:.3g} detections a "
      "pulse and "
      "{:.3g} a second of other light; {} where 3 x 3 pixels are pooled\n",
      std_mps, dwell_in_words(one), light.signal_per_pulse, light.background_per_s,
      dwell_in_words(pooled));
  if (scan && scan->lines > 0 && one) {
    fmt::print("a picture of {} x {} dwells takes {:.3g} s and the scanner's turns\n", scan->pixels,
               scan->lines, *one * 1e-3 * static_cast<double>(scan->pixels * scan->lines));
  }
  return 0;
}

int run_tradeoff(TradeoffCommand options) {
  StopSignals signals;
  const batch::Shard shard =
      options.shard.empty() ? batch::Shard{} : batch::shard_of(options.shard);
  if (options.csv.empty()) options.csv = table_of_plot(options.plot);
  if (!options.shard.empty()) options.csv = table_of_share(options.csv, shard);
  for (const std::string& file : {options.csv, options.plot}) check_folder_of(file);
  Config config = load_config_aloud(options.config);
  OutputCheck outputs(config);
  outputs.add_input("the recording", options.recording);
  outputs.check("--csv", options.csv);
  outputs.check("--plot", options.plot);
  const auto scan = scan_lines(config.frame.by, config.scan, std::nullopt);
  config = one_pixel(std::move(config), options.pixel);
  if (!options.recording.empty()) recording::warn_of_other_pattern(config, options.recording);
  tradeoff::FrameOrigin origin = tradeoff::find_origin(config, options.recording);
  if (origin.scene && options.seed) origin.scene->seed = *options.seed;
  if (options.velocity_std_mps) {
    return tell_dwell(config, scan, origin, *options.velocity_std_mps);
  }
  log_info("frames of {}; {}", origin.name, tradeoff::title_of(config, origin));
  TradeoffRun run(options, config, origin);
  if (options.merge > 0) {
    return finish(options, run.merge(signals, rows_of_shares(options, run.report())));
  }
  const tradeoff::Report& report = run.measure(signals, shard);
  const bool is_stopped = signals.token().stop_requested();
  if (report.rows.empty() && is_stopped) {
    throw Error(Fault::usage, "stopped before anything was measured");
  }
  if (is_stopped) log_warning("stopped: this is what was measured so far");
  if (options.shard.empty()) return finish(options, report);
  // The table of a share that was stopped would look as if it were whole.
  return is_stopped ? stopped_exit_code : finish_share(options, report, shard);
}

void add_options(CLI::App& command, TradeoffCommand& options) {
  command
      .add_option("--config,-c", options.config, "Configuration of the scene or of the recording")
      ->required();
  command.add_option("recording", options.recording,
                     "Recording to take the frames from (default: the configured scene)");
  command.add_option("--pixel", options.pixel, "Name of the pixel to measure (default: the first)");
  command
      .add_option("--lengths", options.lengths_ms,
                  "Frame lengths, ms, such as 10,50 (default: four around the configured length)")
      ->delimiter(',')
      ->allow_extra_args(false)  // else the recording would be read as one more length
      ->check(number_between(0.1, 60'000));
  command.add_option("--frames,-n", options.frames, "Frames to measure with each setting")
      ->check(whole_number_between(10, 1'000'000))
      ->capture_default_str();
  command.add_option("--seed", options.seed, "Seed of the scene (default: the configured seed)")
      ->check(whole_number());
  command
      .add_option("--budget-ms", options.budget_ms,
                  "Recommend the most accurate setting within this time for a frame, ms")
      ->check(number_above_zero());
  command
      .add_option("--velocity-std", options.velocity_std_mps,
                  "Print the dwell of a scan that gives the velocity this standard deviation, m/s; "
                  "measure nothing")
      ->check(number_above_zero());
  command.add_flag("--paper", options.paper,
                   "Also measure the method of the paper, up to tens of times slower");
  command.add_flag("--json", options.json, "Print each setting as a line of JSON");
  command.add_option("--shard", options.shard,
                     "I/N, such as 2/4: measure every N-th frame length from the I-th, into a "
                     "table named ...-IofN");
  command.add_option("--merge", options.merge, "Combine the tables of N shares; measure nothing")
      ->check(whole_number_between(1, 10'000))
      ->excludes("--shard");
  command.add_option("--csv", options.csv, "Table to write (default: the plot's name with .csv)");
  command.add_option("--plot", options.plot, "Picture to write: .svg, .png or .pdf; needs Python")
      ->capture_default_str();
}

}  // namespace

void add_tradeoff(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "tradeoff",
      "Measure speed and accuracy of each setting on the configured scene or a recording");
  const auto options = std::make_shared<TradeoffCommand>();
  add_options(*command, *options);
  add_log_options(*command);
  command->callback([&action, options] { action = [options] { return run_tradeoff(*options); }; });
}

}  // namespace splid
