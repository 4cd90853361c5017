#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/base/log.hpp"
#include "daemon/base/progress.hpp"
#include "daemon/base/text.hpp"
#include "daemon/cloud/clouds.hpp"
#include "daemon/cloud/points.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/output_check.hpp"
#include "daemon/recording/recording_facts.hpp"
#include "daemon/service/stop_signals.hpp"
#include "daemon/stream/open_source.hpp"
#include "daemon/study/replay_frames.hpp"
#include "estimator/model/units.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

struct CloudCommand {
  std::vector<std::string> recordings;
  std::string config;
  std::string output;
  std::string layout;
  bool ascii = false;
  bool force = false;
};

// Measures recordings, one after the other, into one cloud or into one for each frame.
class CloudRun {
 public:
  CloudRun(const Config& config, const CloudCommand& options)
      : name_(options.output),
        points_(config),
        clouds_(format_of(config, options), options.force),
        progress_(host_clock()) {}

  // Returns false after a stop request.
  bool measure(Config& config, const std::string& recording, const std::stop_token& stop) {
    read_from(recording, "", 0, config);
    config.encoder.file.clear();  // a cloud has no reference
    recording::warn_of_other_pattern(config, recording);
    const std::uint64_t first = next_frame_;
    const auto take = [&](const FrameMessage& frame) {
      const std::uint64_t number = first + frame.sequence;
      points_.add(frame, [&](const cloud::Point& point) { clouds_.add(point, number); });
      next_frame_ = number + 1;
      if (progress_.due()) progress_.show(counts());
    };
    measure_frames(config, open_source(config), take, [&stop] { return !stop.stop_requested(); });
    return !stop.stop_requested();
  }

  [[nodiscard]] bool has_points() const { return clouds_.points() > 0; }

  // What is measured so far is the cloud.
  void finish() {
    progress_.clear();
    clouds_.finish();
    std::string line = name_ + ": " + counts();
    if (clouds_.are_many()) line += " in " + grouped(clouds_.files()) + " files";
    if (const std::string left = points_.left_out(); !left.empty()) line += "; left out: " + left;
    log_info(line);
    if (points_.ambiguous() > 0) {
      log_warning("{} points are at a range that is ambiguous", grouped(points_.ambiguous()));
    }
    if (points_.without_direction() > 0) {
      log_warning("{} frames have no direction: /scan/angles has no row for their time",
                  grouped(points_.without_direction()));
    }
    if (!has_points()) log_warning("{} has no point", name_);
  }

  void say_stopped() {
    progress_.clear();
    if (clouds_.are_many()) {
      log_warning("stopped after {} files", grouped(clouds_.files()));
    } else {
      log_warning("stopped; {} was not written", name_);
    }
  }

 private:
  static cloud::FormatOptions format_of(const Config& config, const CloudCommand& options) {
    const double largest_ns = config.pattern.unambiguous_delay_ps * ns_per_ps;
    return {options.output, options.ascii, options.layout,
            speed_of_light_mps * 1e-9 / 2 * largest_ns};
  }
  [[nodiscard]] std::string counts() const {
    return grouped(clouds_.points()) + " points of " + grouped(points_.frames()) + " frames";
  }

  std::string name_;
  cloud::Points points_;
  cloud::Clouds clouds_;
  Progress progress_;
  std::uint64_t next_frame_ = 0;  // of the recordings together
};

int write_cloud(const CloudCommand& options) {
  const StopSignals signals;
  Config config = load_config_aloud(options.config);
  OutputCheck outputs(config);
  for (const std::string& recording : options.recordings) {
    outputs.add_input("a recording", recording);
  }
  outputs.check("--output", options.output);
  CloudRun run(config, options);
  for (const std::string& recording : options.recordings) {
    try {
      if (run.measure(config, recording, signals.token())) continue;
    } catch (const Error& error) {
      if (error.fault() == Fault::data && run.has_points()) run.finish();
      throw;
    }
    run.say_stopped();
    return stopped_exit_code;
  }
  run.finish();
  return 0;
}

}  // namespace

void add_cloud(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "cloud", "Measure recordings of an array into a point cloud with velocities");
  const auto options = std::make_shared<CloudCommand>();
  command->add_option("recordings", options->recordings, "Recordings in order of time")->required();
  command
      ->add_option("--config,-c", options->config,
                   "Configuration with the direction of each pixel; its source is not used")
      ->required();
  command
      ->add_option("--output,-o", options->output,
                   "Cloud to write: .pcd, .ply, .las, .xyzd (Open3D) or .bin (rows of float32), in "
                   "m and m/s, receding positive. A name with %d, %06d (frame number) or %t (time, "
                   "us) gives a file for each frame")
      ->required();
  command
      ->add_option(
          "--layout", options->layout,
          "Row of a .bin file: dicp x y z v, aeva x y z v t (ns), boreas x y z intensity v t (s)")
      ->check(CLI::IsMember({"dicp", "aeva", "boreas"}));
  command->add_flag("--ascii", options->ascii, "Write .pcd and .ply as text");
  command->add_flag("--force", options->force, "Overwrite an existing file");
  add_log_options(*command);
  command->callback([&action, options] { action = [options] { return write_cloud(*options); }; });
}

}  // namespace splid
