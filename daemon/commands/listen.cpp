#include <fmt/core.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/read_file.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/base/line_writer.hpp"
#include "daemon/base/text.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/number_check.hpp"
#include "daemon/security/key_file.hpp"
#include "daemon/service/stop_signals.hpp"
#include "daemon/sockets/subscriber.hpp"
#include "daemon/study/truth_score.hpp"
#include "daemon/view/field_picture.hpp"
#include "daemon/view/terminal_screen.hpp"
#include "daemon/view/watch_picture.hpp"
#include "protocol/error.hpp"
#include "protocol/fold_json.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/json_value.hpp"
#include "protocol/scene_json.hpp"
#include "protocol/shown_text.hpp"
#include "protocol/status_json.hpp"

namespace splid {
namespace {

struct ListenCommand {
  std::string endpoint = "tcp://127.0.0.1:9872";
  std::vector<std::string> topics;
  bool json = false;
  bool watch = false;
  std::uint64_t count = 0;  // 0: no limit
  double timeout_s = 0;     // 0: none
  std::string key;          // file of a secret key; empty: none
  std::string server_key;   // a public key or its file
  std::string truth;
  TruthLimits limits;
};

std::optional<security::CurveClient> client_of(const ListenCommand& options) {
  if (options.key.empty()) return std::nullopt;
  return security::CurveClient{
      asked_by("--key", [&] { return security::read_secret_key(options.key); }),
      asked_by("--server-key", [&] { return security::read_public_key(options.server_key); })};
}

bool is_among(const std::vector<std::string>& topics, const std::string& topic) {
  return std::any_of(topics.begin(), topics.end(),
                     [&](const std::string& prefix) { return topic.rfind(prefix, 0) == 0; });
}

bool is_of_frames(const std::string& topic) {
  return topic == topic_frame || topic.starts_with(pixel_topic(""));
}

// A value in a column of the given width; a dash where there is no value.
std::string column(fmt::format_string<double> pattern, const std::optional<double>& value,
                   double factor, int width) {
  if (!value) return fmt::format("{:>{}}", "-", width);
  return fmt::format(pattern, *value * factor);
}

constexpr const char* heading =
    "        time    distance m  +- mm   velocity m/s +- cm/s   S/pulse     b /s  photons  "
    "status";

std::string frame_line(const FrameMessage& frame, const std::optional<FrameError>& error) {
  std::string line =
      clock_time(frame.timestamp_s) + "  " + column("{:>12.5f}", frame.distance_m, 1, 12) + " " +
      column("{:>6.2f}", frame.std_distance_m, 1e3, 6) + " " +
      column("{:>14.4f}", frame.velocity_mps, 1, 14) + " " +
      column("{:>7.2f}", frame.std_velocity_mps, 1e2, 7) + " " +
      column("{:>9.3g}", frame.signal_per_pulse, 1, 9) + " " +
      column("{:>8.4g}", frame.background_per_s, 1, 8) + " " +
      fmt::format("{:>8}", frame.photons ? std::to_string(*frame.photons).c_str() : "-") + "  " +
      to_string(frame.status);
  if (frame.status == FrameStatus::ambiguous && frame.mode != Mode::ambiguous) {
    line += "  range odds" + column("{:>+6.1f} nats", frame.range_odds_nats, 1, 0);
  }
  if (!frame.findings.empty()) line += "  " + in_words(frame.findings);
  if (error) {
    line += fmt::format("  error {:>+8.3f} mm {:>+8.3f} cm/s{}", error->distance_m * 1e3,
                        error->velocity_mps * 1e2, error->wrong_peak ? "  WRONG PEAK" : "");
  }
  return line;
}

Error silence(const ListenCommand& options, security::HandshakeWatch::State state,
              const std::optional<security::CurveClient>& client) {
  return {Fault::device, fmt::format("no message for {:g} s: ", options.timeout_s) +
                             in_words(state, options.endpoint, client ? &*client : nullptr)};
}

class Listening {
 public:
  explicit Listening(const ListenCommand& options)
      : options_(options),
        client_(client_of(options)),
        subscriber_(options.endpoint, subscriptions(options), client_) {
    if (!options.truth.empty()) {
      score_.emplace(
          asked_by("--truth", [&] { return truth_from_json(read_file(options.truth)); }));
    }
  }

  int run(const std::stop_token& stop) {
    heard_ns_ = host_clock().steady_ns();
    if (!options_.json && is_among(options_.topics, topic_frame)) out_.write(heading);
    while (!stop.stop_requested() && !done_) {
      if (const auto message = subscriber_.receive(std::chrono::milliseconds{100})) {
        heard_ns_ = host_clock().steady_ns();
        take(*message);
      } else {
        look_at_connection();
        check_timeout();
      }
    }
    return finish();
  }

 private:
  // The topics asked for and the status, which is needed to notice that the daemon stops.
  static std::vector<std::string> subscriptions(const ListenCommand& options) {
    std::vector<std::string> topics = options.topics;
    if (!is_among(topics, topic_status)) topics.emplace_back(topic_status);
    return topics;
  }

  void take(const sockets::Subscriber::Message& message) {
    if (is_of_frames(message.topic)) {
      take_frame(message);
    } else if (message.topic == topic_scene && !options_.json) {
      take_scene(message.json);
    } else if (is_among(options_.topics, message.topic)) {
      print(options_.json ? message.json : message.topic + " " + message.json);
    }
    if (message.topic == topic_status) take_status(message.json);
  }

  void take_status(const std::string& json) {
    const auto status = json_value_if_any(json);
    if (!status.is_object()) return;
    const auto text = [&](const char* name) {
      const auto at = status.find(name);
      return at != status.end() && at->is_string() ? at->get<std::string>() : std::string{};
    };
    tell_measurement(text("state"), text("measurement"), text("reason"));
    tell_findings(findings_from_json(json));
    if (text("state") == to_string(DaemonState::stopping)) done_ = true;
  }

  // Each turn once; that all is well is news only after something else, and that it starts or
  // stops is not news by itself.
  void tell_measurement(const std::string& state, const std::string& measurement,
                        const std::string& reason) {
    const bool is_end = state == to_string(DaemonState::stopping);
    if (state == to_string(DaemonState::starting) || (is_end && reason.empty())) return;
    const std::string words = headline(state, measurement);
    const bool is_first = headline_.empty();
    if (words == std::exchange(headline_, words)) return;
    if (is_first && words == "ok") return;
    std::fprintf(stderr, "splid: %s\n",
                 shown_text(words + (reason.empty() ? "" : ": " + reason), most_said).c_str());
  }

  // Each once, until the status no longer has it.
  void tell_findings(const std::vector<FrameMessage::Finding>& findings) {
    std::vector<std::string> names;
    for (const FrameMessage::Finding& finding : findings) {
      names.push_back(finding.name);
      if (std::find(told_.begin(), told_.end(), finding.name) != told_.end()) continue;
      std::fprintf(stderr, "splid: %s\n",
                   shown_text(with_advice(finding), std::string::npos).c_str());
    }
    told_ = names;
  }

  void take_frame(const sockets::Subscriber::Message& message) {
    if (!is_among(options_.topics, message.topic)) return;
    const std::optional<FrameMessage> frame = read(message.json);
    if (!frame) return;
    const auto error = score_ ? score_->take(*frame) : std::nullopt;
    print(options_.json ? message.json : frame_line(*frame, error));
  }

  // A field of pixels is drawn anew for each frame; on a terminal in the same place.
  void take_scene(const std::string& json) {
    if (!is_among(options_.topics, topic_scene)) return;
    try {
      const std::vector<std::string> lines = view::field_lines(
          scene_from_json(json), characters_, std::numeric_limits<std::size_t>::max());
      std::string text;
      for (const std::string& line : lines) text += (text.empty() ? "" : "\n") + line;
      const bool overwrites = isatty(STDOUT_FILENO) == 1 && shown_ > 0;
      if (overwrites) text = fmt::format("\x1b[{}A\x1b[J", drawn_lines_) + text;
      drawn_lines_ = lines.size();
      print_lines(text);
    } catch (const Error& error) {
      tell_unread(error);
    }
  }

  // Absent for a message that cannot be read. Of these the first is told at once, and all at the
  // end.
  std::optional<FrameMessage> read(const std::string& json) {
    try {
      return frame_from_json(json);
    } catch (const Error& error) {
      tell_unread(error);
      return std::nullopt;
    }
  }

  void tell_unread(const Error& error) {
    if (++unread_ > 1) return;
    std::fprintf(stderr, "splid: a frame message cannot be read and is left out: %s\n",
                 shown_text(error.what(), most_said).c_str());
  }

  void print(const std::string& line) { print_lines(shown_text(line, std::string::npos)); }

  // text: made here of what is known to be harmless.
  void print_lines(const std::string& text) {
    if (!out_.write(text)) done_ = true;
    ++shown_;
    if (options_.count != 0 && shown_ == options_.count) done_ = true;
  }

  // Reports each change of the connection once. After a refusal the subscriber goes on trying,
  // since the server's allow-list may get this key meanwhile.
  void look_at_connection() {
    using State = security::HandshakeWatch::State;
    const State state = subscriber_.state();
    if (state == said_ || state == State::pending) return;
    const bool is_first = said_ == State::pending && state == State::connected;
    said_ = state;
    if (is_first) return;  // connecting at once is no news
    std::fprintf(stderr, "splid: %s\n", connection(state).c_str());
  }

  [[nodiscard]] std::string connection(security::HandshakeWatch::State state) const {
    return in_words(state, options_.endpoint, client_ ? &*client_ : nullptr);
  }

  void check_timeout() {
    const double silent_s = static_cast<double>(host_clock().steady_ns() - heard_ns_) / 1e9;
    if (options_.timeout_s == 0 || silent_s < options_.timeout_s) return;
    throw silence(options_, subscriber_.state(), client_);
  }

  int finish() const {
    if (unread_ > 0) {
      std::fprintf(stderr, "splid: %s frame messages could not be read and are left out\n",
                   grouped(unread_).c_str());
    }
    if (!score_) return 0;
    std::fprintf(stderr, "%s\n", score_->summary().c_str());
    if (const auto broken = score_->broken(options_.limits)) throw Error(Fault::data, *broken);
    return 0;
  }

  const ListenCommand& options_;
  std::optional<security::CurveClient> client_;
  sockets::Subscriber subscriber_;
  security::HandshakeWatch::State said_ = security::HandshakeWatch::State::pending;
  LineWriter out_{stdout, "standard output"};
  std::optional<TruthScore> score_;
  std::int64_t heard_ns_ = 0;
  std::string headline_;           // of the last status
  std::vector<std::string> told_;  // names of its findings
  std::uint64_t shown_ = 0;        // messages printed
  std::uint64_t unread_ = 0;       // messages that cannot be read
  view::Characters characters_ = view::terminal_characters();
  std::size_t drawn_lines_ = 0;  // of the last field
  bool done_ = false;
};

// The topic whose values a picture shows; empty: none.
std::string topic_of_values(const std::vector<std::string>& topics) {
  const auto is_more = std::count_if(topics.begin(), topics.end(), is_of_frames) > 1;
  const auto found = std::find_if(topics.begin(), topics.end(), is_of_frames);
  if (is_more || (found != topics.end() && *found == pixel_topic(""))) {
    throw Error(Fault::usage, "--watch shows the values of one pixel: give one topic frame/NAME");
  }
  return found == topics.end() ? "" : *found;
}

// Fills the terminal with what a daemon publishes, until a signal comes or --count messages of the
// first topic did. A daemon that stops is waited for.
class Watching {
 public:
  explicit Watching(const ListenCommand& options)
      : options_(options),
        client_(client_of(options)),
        subscriber_(options.endpoint, subscriptions(options.topics), client_),
        picture_(options.endpoint, view::terminal_characters(), topic_of_values(options.topics)) {}

  int run(const std::stop_token& stop) {
    heard_ns_ = host_clock().steady_ns();
    view::TerminalScreen screen;
    draw(screen);
    while (!stop.stop_requested() && (options_.count == 0 || frames_ < options_.count)) {
      const auto message = subscriber_.receive(std::chrono::milliseconds{100});
      if (message) {
        heard_ns_ = host_clock().steady_ns();
        frames_ += counts(message->topic) ? 1 : 0;
        picture_.take(message->topic, message->json);
      }
      look_at_connection();
      if (screen.look_at_size() || is_due()) draw(screen);
    }
    return 0;
  }

 private:
  // `frame` alone is what there is without a choice: a daemon of several pixels has scenes instead.
  static std::vector<std::string> subscriptions(std::vector<std::string> topics) {
    if (topics.front() == topic_frame && !is_among(topics, topic_scene)) {
      topics.emplace_back(topic_scene);
    }
    for (const char* topic : {topic_status, topic_version}) {
      if (!is_among(topics, topic)) topics.emplace_back(topic);
    }
    return topics;
  }

  [[nodiscard]] bool counts(const std::string& topic) const {
    const std::string& first = options_.topics.front();
    return topic == first || (first == topic_frame && topic == topic_scene);
  }

  // Ten pictures a second are enough for eyes, and little for a line over ssh.
  bool is_due() const { return host_clock().steady_ns() - drawn_ns_ >= 100'000'000; }

  void draw(const view::TerminalScreen& screen) {
    drawn_ns_ = host_clock().steady_ns();
    screen.show(picture_.lines({screen.columns(), screen.rows()}, true));
  }

  void look_at_connection() {
    const security::HandshakeWatch::State state = subscriber_.state();
    const bool well = state == security::HandshakeWatch::State::connected;
    picture_.set_connection(
        well ? "" : in_words(state, options_.endpoint, client_ ? &*client_ : nullptr));
    const double silent_s = static_cast<double>(host_clock().steady_ns() - heard_ns_) / 1e9;
    if (options_.timeout_s == 0 || silent_s < options_.timeout_s) return;
    throw silence(options_, state, client_);
  }

  const ListenCommand& options_;
  std::optional<security::CurveClient> client_;
  sockets::Subscriber subscriber_;
  view::WatchPicture picture_;
  std::int64_t heard_ns_ = 0;
  std::int64_t drawn_ns_ = 0;
  std::uint64_t frames_ = 0;
};

int listen(ListenCommand options) {
  const StopSignals signals;
  if (options.key.empty() != options.server_key.empty()) {
    throw Error(Fault::usage,
                "--key and --server-key go together: your secret key (splid keys makes it), and "
                "the server's .key file");
  }
  if (options.topics.empty()) options.topics = {topic_frame};
  if (options.limits.any() && options.truth.empty()) {
    throw Error(Fault::usage, "--max-distance-rmse-mm and --max-velocity-rmse-cmps need --truth");
  }
  if (options.watch && view::TerminalScreen::can_be_had()) {
    const bool has_values = std::any_of(options.topics.begin(), options.topics.end(), is_of_frames);
    if (!has_values && !is_among(options.topics, topic_scene)) options.topics = {topic_frame};
    return Watching(options).run(signals.token());
  }
  return Listening(options).run(signals.token());
}

CLI::Validator topic_check() {
  const CLI::Validator known =
      CLI::IsMember({topic_frame, topic_scene, topic_status, topic_version, topic_fold});
  return {[known](std::string& topic) {
            if (topic.starts_with(pixel_topic(""))) return std::string{};
            return known(topic);
          },
          known.get_description()};
}

void add_truth_options(CLI::App& command, ListenCommand& options) {
  command.add_option(
      "--truth", options.truth,
      "Truth of a simulated scene (FILE.truth.json): print each frame's error, and their RMSE");
  command
      .add_option("--max-distance-rmse-mm", options.limits.max_distance_rmse_mm,
                  "With --truth: exit code 4 if the RMSE is larger, or a frame is lost or wrong")
      ->check(number_above_zero());
  command
      .add_option("--max-velocity-rmse-cmps", options.limits.max_velocity_rmse_cmps,
                  "With --truth: exit code 4 if the RMSE is larger, or a frame is lost or wrong")
      ->check(number_above_zero());
}

}  // namespace

void add_listen(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("listen", "Print what a running splid publishes");
  const auto options = std::make_shared<ListenCommand>();
  command->add_option("--endpoint,-e", options->endpoint, "The daemon's publish.endpoint")
      ->capture_default_str();
  command
      ->add_option("topics", options->topics,
                   "frame (default), scene, frame/NAME of a pixel, status, version, fold")
      ->check(topic_check());
  command->add_option("--key", options->key, "File of your secret key (splid keys), for CURVE");
  command->add_option("--server-key", options->server_key,
                      "The server's public key, or its file, for CURVE");
  CLI::Option* json = command->add_flag("--json", options->json, "Print the messages as JSON");
  command
      ->add_flag("--watch,-w", options->watch,
                 "Fill the terminal with state, values, their last seconds and pictures of an "
                 "array (plain lines without a terminal)")
      ->excludes(json);
  command->add_option("--count,-n", options->count, "End after this many messages")
      ->check(whole_number_above_zero());
  command->add_option("--timeout", options->timeout_s, "Fail if no message comes for this time, s")
      ->check(number_above_zero());
  add_truth_options(*command, *options);
  command->callback([&action, options] { action = [options] { return listen(*options); }; });
}

}  // namespace splid
