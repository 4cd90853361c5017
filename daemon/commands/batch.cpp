#include <fmt/core.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/base/log.hpp"
#include "daemon/base/progress.hpp"
#include "daemon/base/text.hpp"
#include "daemon/batch/batch_folder.hpp"
#include "daemon/batch/batch_list.hpp"
#include "daemon/batch/measure_part.hpp"
#include "daemon/batch/merge_slices.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/number_check.hpp"
#include "daemon/service/stop_signals.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

constexpr std::int64_t most_jobs = 64;

struct BatchCommand {
  std::vector<std::string> files;
  std::string config;
  std::string output;
  std::string shard;
  std::int64_t jobs = std::clamp<std::int64_t>(std::thread::hardware_concurrency(), 1, most_jobs);
};

std::string duration_text(double seconds) {
  if (seconds < 100) return fmt::format("{:.0f} s", seconds);
  if (seconds < 6000) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

// Says how far a batch has come: on a terminal in a line that is overwritten, and otherwise in the
// log, once a minute.
class BatchProgress {
 public:
  explicit BatchProgress(std::uint64_t bytes)
      : line_(host_clock()), bytes_(bytes), begun_ns_(host_clock().steady_ns()) {}

  // The next part is that of the recording `name`.
  void begin(std::string name) {
    name_ = std::move(name);
    part_bytes_ = 0;
  }
  // bytes: how much of the part is measured.
  void reach(std::uint64_t bytes) {
    part_bytes_ = bytes;
    if (line_.due()) line_.show(text());
    const std::int64_t now_ns = host_clock().steady_ns();
    if (terminal_ || now_ns < next_log_ns_) return;
    next_log_ns_ = now_ns + log_interval_ns;
    log_info(text());
  }
  // The part is measured, in this run or in one before.
  void finish(std::uint64_t bytes, bool in_this_run) {
    part_bytes_ = 0;
    if (in_this_run) {
      done_bytes_ += bytes;
    } else {
      bytes_ -= bytes;
    }
  }
  void clear() { line_.clear(); }

 private:
  static constexpr std::int64_t log_interval_ns = 60'000'000'000;

  [[nodiscard]] std::string text() const {
    const double share =
        static_cast<double>(done_bytes_ + part_bytes_) / static_cast<double>(std::max(bytes_, one));
    const double took_s = static_cast<double>(host_clock().steady_ns() - begun_ns_) * 1e-9;
    std::string text = fmt::format("{}; {:.0f} % of all", name_, 100 * share);
    if (share > 0) text += ", " + duration_text(took_s / share - took_s) + " left";
    return text;
  }

  static constexpr std::uint64_t one = 1;

  Progress line_;
  bool terminal_ = ::isatty(STDERR_FILENO) == 1;
  std::uint64_t bytes_;  // to be measured in this run
  std::uint64_t done_bytes_ = 0;
  std::uint64_t part_bytes_ = 0;
  std::string name_;
  std::int64_t begun_ns_;
  std::int64_t next_log_ns_ = begun_ns_ + log_interval_ns;
};

// One shard's run over all recordings.
class BatchRun {
 public:
  BatchRun(std::vector<batch::Recording> recordings, batch::Shard shard, batch::Meter meter,
           batch::Folder folder)
      : recordings_(std::move(recordings)),
        shard_(shard),
        meter_(std::move(meter)),
        folder_(std::move(folder)),
        progress_(own_bytes()) {
    folder_.begin(meter_.facts(), recordings_);
  }

  // Returns the exit code.
  int run(const std::stop_token& stop) {
    for (const batch::Recording& recording : recordings_) {
      if (!measure(recording, stop)) return say_stopped();
    }
    progress_.clear();
    if (shard_.count > 1) {
      log_info("shard {} of {} is measured; splid merge {} makes the tables once all are",
               shard_.index, shard_.count, folder_.path());
    } else {
      batch::merge_folder(folder_);
      log_info("{} of {} recordings are measured; {} has a line for each",
               recordings_.size() - failures_.size(), recordings_.size(), folder_.summary_file());
    }
    return say_failures();
  }

 private:
  [[nodiscard]] batch::Part part(const batch::Recording& recording) const {
    return batch::part_of(shard_, recording, batch::bytes_of(recordings_));
  }

  [[nodiscard]] std::uint64_t own_bytes() const {
    std::uint64_t bytes = 0;
    for (const batch::Recording& recording : recordings_) bytes += part(recording).bytes();
    return bytes;
  }

  // Returns false where it was stopped.
  bool measure(const batch::Recording& recording, const std::stop_token& stop) {
    const batch::Part own = part(recording);
    if (own.bytes() == 0) return true;
    if (stop.stop_requested()) return false;
    progress_.begin(recording.name);
    try {
      const bool is_there = meter_.is_measured(recording, own, folder_);
      const auto reach = [this, &own](std::uint64_t position) {
        progress_.reach(std::clamp(position, own.begin, own.end) - own.begin);
      };
      if (!is_there && !meter_.measure(recording, own, folder_, reach, stop)) return false;
      progress_.finish(own.bytes(), !is_there);
      ++measured_;
      if (shard_.count == 1) batch::merge_slices(folder_, recording);
    } catch (const Error& error) {
      if (error.fault() != Fault::data) throw;
      fail(recording, error.what());
      progress_.finish(own.bytes(), true);
    }
    return true;
  }

  // Keeps why a recording cannot be measured, and goes on with the next.
  void fail(const batch::Recording& recording, std::string why) {
    if (!why.starts_with(recording.file)) why = recording.file + ": " + why;
    folder_.write(recording, batch::failure_of_recording, {{"why", why}});
    progress_.clear();
    log_warning("{}; going on with the next recording", why);
    failures_.push_back(std::move(why));
  }

  int say_stopped() {
    progress_.clear();
    log_warning("stopped: {} of {} recordings are measured; the same command resumes", measured_,
                recordings_.size());
    return stopped_exit_code;
  }

  int say_failures() const {
    if (failures_.empty()) return 0;
    log_error("{} of {} recordings cannot be measured:", failures_.size(), recordings_.size());
    for (const std::string& failure : failures_) log_error(failure);
    return static_cast<int>(Fault::data);
  }

  std::vector<batch::Recording> recordings_;
  batch::Shard shard_;
  batch::Meter meter_;
  batch::Folder folder_;
  BatchProgress progress_;
  std::size_t measured_ = 0;
  std::vector<std::string> failures_;
};

int run_batch(const BatchCommand& options) {
  const StopSignals signals;
  const batch::Shard shard =
      options.shard.empty() ? batch::Shard{} : batch::shard_of(options.shard);
  std::vector<batch::Recording> recordings = batch::find_recordings(options.files);
  Config config = load_config_aloud(options.config);
  const batch::Slicing slicing = batch::Slicing::of_pixels(config.pixels.size());
  batch::Meter meter(std::move(config), options.jobs, slicing);
  BatchRun run(std::move(recordings), shard, std::move(meter), batch::Folder(options.output));
  return run.run(signals.token());
}

int merge(const std::string& folder) {
  const std::vector<batch::Outcome> outcomes = batch::merge_folder(batch::Folder(folder));
  std::size_t done = 0;
  for (const batch::Outcome& outcome : outcomes) {
    if (outcome.state == batch::State::done) {
      ++done;
    } else {
      log_error("{}: {}", outcome.state == batch::State::failed ? "failed" : "unfinished",
                outcome.why);
    }
  }
  log_info("{} of {} recordings have their tables; {} has a line for each", done, outcomes.size(),
           batch::Folder(folder).summary_file());
  return done == outcomes.size() ? 0 : static_cast<int>(Fault::data);
}

}  // namespace

void add_batch(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("batch", "Measure many recordings, with a table for each");
  const auto options = std::make_shared<BatchCommand>();
  command->add_option("files", options->files, "Recordings, and folders of recordings")->required();
  command->add_option("--config,-c", options->config, "Configuration; its source is not used")
      ->required();
  command
      ->add_option("--output,-o", options->output,
                   "Folder for the tables: new, empty, or that of an unfinished batch")
      ->required();
  command->add_option("--shard", options->shard, "I/N: measure share I of N, for splid merge");
  command
      ->add_option("--jobs,-j", options->jobs,
                   "Frames estimated at the same time (default: number of processors)")
      ->check(number_between(1, most_jobs));
  add_log_options(*command);
  command->callback([&action, options] { action = [options] { return run_batch(*options); }; });
}

void add_merge(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("merge", "Make tables and summary from all shares of a batch");
  const auto folder = std::make_shared<std::string>();
  command->add_option("folder", *folder, "Output folder of the batch")->required();
  add_log_options(*command);
  command->callback([&action, folder] { action = [folder] { return merge(*folder); }; });
}

}  // namespace splid
