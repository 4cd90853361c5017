
#include <CLI/CLI.hpp>
#include <memory>
#include <stdexcept>
#include <string>

#include "config/channel_name.hpp"
#include "config/config.hpp"
#include "daemon/base/log.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/number_check.hpp"
#include "daemon/commands/output_check.hpp"
#include "daemon/recording/frame_log.hpp"
#include "daemon/recording/recording_facts.hpp"
#include "daemon/service/session.hpp"
#include "daemon/service/stop_signals.hpp"
#include "daemon/stream/open_source.hpp"
#include "daemon/study/replay_frames.hpp"
#include "drivers/replay/recording_info.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

// How many tags are searched for the configured channels, which takes a tenth of a second.
constexpr std::uint64_t tags_looked_at = 4'000'000;

constexpr double most_wait_s = 1e6;

// Some seconds of frames: a replay at full speed makes thousands of frames a second.
constexpr int queue_messages = 20'000;

struct ReplayCommand {
  std::string recording;
  std::string config;
  std::string encoder;
  std::string speed = "max";
  std::string output;
  bool force = false;
  bool json = false;
  bool no_publish = false;
  double wait_for_subscriber_s = 0;
};

// Reads --speed: "max" or a number above 0. Returns the speed as in ReplayOptions, where 0 is
// "max".
double speed_of(const std::string& text) {
  if (text == "max") return 0;
  std::size_t used = 0;
  double speed = 0;
  try {
    speed = std::stod(text, &used);
  } catch (const std::logic_error&) {
    used = 0;
  }
  if (used == text.size() && speed > 0 && speed <= 1e6) return speed;
  throw Error(Fault::usage, "--speed " + text +
                                ": must be max, or a number above 0 and at most 1000000: how many "
                                "times the recorded pace");
}

bool occurs(const RecordingInfo& info, const ChannelName& channel) {
  if (channel.kind == TagKind::sync) return info.syncs > 0;
  if (channel.kind == TagKind::photon) return info.photons.contains(channel.value);
  for (std::size_t bits = 0; bits < info.markers.size(); ++bits) {
    if (info.markers[bits] > 0 && channel.matches(marker_tag(0, static_cast<int>(bits)))) {
      return true;
    }
  }
  return false;
}

void warn_unless_it_occurs(const RecordingInfo& info, const std::string& file, const char* key,
                           const std::string& name) {
  const auto channel = parse_channel(name);
  if (!channel || occurs(info, *channel)) return;
  log_warning("{} {} never occurs{}; {} has {}", key, name,
              info.whole ? "" : " in its first 4 million tags", file, channels_in_words(info));
}

// Warns of configured channels that do not occur in the recording and of another pattern, and
// refuses a width that its pulses cannot have. It does
// not look for the encoder's channel: most recordings have no encoder, and frames do without.
void warn_of_what_does_not_fit(const Config& config, const std::string& file) {
  const RecordingInfo info = scan_recording(file, tags_looked_at);
  recording::check_width(config, info.header);
  const bool has_pixels = !config.channels.pixels.empty();
  for (const std::string& name : config.channels.photon_names()) {
    warn_unless_it_occurs(info, file, has_pixels ? "pixels: input" : "channels.photon", name);
  }
  warn_unless_it_occurs(info, file, "channels.sync", config.channels.sync);
  for (const std::string& doubt :
       doubts_of_t3(info, pattern_period_ps(config.pattern), config.pulse.sigma_ps)) {
    log_warning("{}: {}", file, doubt);
  }
  const std::string other = recording::other_pattern_than_recorded(config, info.header, file);
  if (!other.empty()) log_warning(other);
}

// Null where no table is asked for.
std::unique_ptr<recording::FrameLog> open_table(const Config& config,
                                                const ReplayCommand& options) {
  if (options.output.empty()) return nullptr;
  (void)recording::table_format_of(options.output, "--output");
  OutputCheck outputs(config);
  outputs.add_input("the recording", options.recording);
  outputs.check("--output", options.output);
  const auto say = [](const std::string& sentence) { log_warning(sentence); };
  return std::make_unique<recording::FrameLog>(
      options.output, recording::table_facts(config, options.recording), options.force, say);
}

// Errors: Error(Fault::device) where not every frame is in the table.
void finish(recording::FrameLog& frames, const std::stop_token& stop) {
  frames.finish(stop);
  if (const std::string fault = frames.fault(); !fault.empty()) throw Error(Fault::device, fault);
  log_info(frames.summary());
}

int replay(const ReplayCommand& options) {
  const StopSignals signals;
  const double speed = speed_of(options.speed);
  Config config = load_config_aloud(options.config);
  read_from(options.recording, options.encoder, speed, config);
  DeviceMonitor device;
  std::unique_ptr<TagSource> recording = open_source(config, device.hears());
  warn_of_what_does_not_fit(config, options.recording);
  SessionOptions session;
  const std::unique_ptr<recording::FrameLog> frames = open_table(config, options);
  session.frames = frames.get();
  session.json = options.json;
  session.may_only_print = options.json || frames;
  session.publish = !options.no_publish;
  session.queue_messages = queue_messages;
  session.wait_for_subscriber_s = options.wait_for_subscriber_s;
  const int code = run_session(config, std::move(recording), device, session, signals.token());
  if (frames) finish(*frames, signals.token());
  return code;
}

}  // namespace

void add_replay(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("replay", "Measure a recording again");
  const auto options = std::make_shared<ReplayCommand>();
  command->add_option("recording", options->recording, "Recording, T2 or T3 mode")->required();
  command->add_option("--config,-c", options->config, "Configuration; its source is not used")
      ->required();
  command->add_option("--encoder", options->encoder,
                      "Counts of the encoder (default: RECORDING.encoder.csv, if there is one)");
  command->add_option("--speed", options->speed, "max, or a multiple of the recorded pace")
      ->capture_default_str();
  CLI::Option* output = command->add_option(
      "--output,-o", options->output, "Table of the frames to write: .h5 (HDF5) or .csv (text)");
  command->add_flag("--force", options->force, "Overwrite an existing table")->needs(output);
  command->add_flag("--json", options->json, "Print each frame as a line of JSON");
  CLI::Option* wait = command
                          ->add_option("--wait-for-subscriber", options->wait_for_subscriber_s,
                                       "Longest wait for a subscriber before the replay starts, s")
                          ->check(number_between(0, most_wait_s));
  command
      ->add_flag("--no-publish", options->no_publish,
                 "Bind no endpoint; frames go to --json and --output only")
      ->excludes(wait);
  add_log_options(*command);
  command->callback([&action, options] { action = [options] { return replay(*options); }; });
}

}  // namespace splid
