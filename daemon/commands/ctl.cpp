#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "config/config.hpp"
#include "config/endpoint.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/base/progress.hpp"
#include "daemon/base/text.hpp"
#include "daemon/base/write_file.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/number_check.hpp"
#include "daemon/commands/output_check.hpp"
#include "daemon/security/key_file.hpp"
#include "daemon/service/control/control_client.hpp"
#include "daemon/service/control/control_endpoint.hpp"
#include "daemon/service/stop_signals.hpp"
#include "daemon/study/calibration/calibration_report.hpp"
#include "protocol/error.hpp"
#include "protocol/json_value.hpp"
#include "protocol/pattern_json.hpp"
#include "protocol/shown_text.hpp"

namespace splid {
namespace {

struct CtlCommand {
  std::string endpoint;
  std::string config;
  std::string key;         // file of a secret key; empty: none
  std::string server_key;  // a public key or its file
  control::Request request;
  bool json = false;
  std::string output;  // pattern file
  bool force = false;
};

// The endpoint that the options name, or else the default.
std::string endpoint_of(const CtlCommand& options) {
  std::string endpoint = options.endpoint;
  if (endpoint.empty()) {
    endpoint = options.config.empty() ? "auto" : load_config(options.config).control.endpoint;
  }
  if (endpoint == "auto") return control::default_endpoint();
  if (endpoint == "off") throw Error(Fault::usage, "control.endpoint is off: nobody listens there");
  if (const auto fault = endpoint_fault(endpoint)) {
    throw Error(Fault::usage, "endpoint " + endpoint + " " + *fault);
  }
  const bool is_tcp = endpoint.starts_with("tcp://");
  if (is_tcp == options.key.empty() || is_tcp == options.server_key.empty()) {
    throw Error(Fault::usage,
                "endpoint " + endpoint +
                    ": --key and --server-key go with tcp://, both, and with nothing else: your "
                    "secret key (splid keys makes it), and the server's .key file");
  }
  return endpoint;
}

std::optional<security::CurveClient> keys_of(const CtlCommand& options) {
  if (options.key.empty()) return std::nullopt;
  return security::CurveClient{
      asked_by("--key", [&] { return security::read_secret_key(options.key); }),
      asked_by("--server-key", [&] { return security::read_public_key(options.server_key); })};
}

// The text of a member of the reply; empty where the reply has no such member.
std::string text_of(const control::Reply& reply, const char* name) {
  const auto value = json_value_if_any(reply.find(name));
  return value.is_string() ? shown_text(value.get<std::string>(), most_said) : "";
}

control::Reply ask(const CtlCommand& options) {
  const StopSignals signals;
  const std::string endpoint = endpoint_of(options);
  control::Client client(endpoint, keys_of(options));
  Progress progress(host_clock());
  const auto show = [&progress](const control::Reply& status) {
    const std::string text = text_of(status, "progress");
    if (!text.empty() && progress.due()) progress.show(text);
  };
  return client.ask(options.request, show, signals.token());
}

std::string count_of(const nlohmann::json& status, const char* key) {
  return grouped(status.value(key, std::uint64_t{0}));
}

void print_status(const control::Reply& reply) {
  const auto status = json_value_if_any(reply.find("status"));
  if (!status.is_object()) throw Error(Fault::data, "the daemon has no status yet; ask again");
  const auto text = [&status](const char* key) {
    return shown_text(status.value(key, ""), most_said);
  };
  const auto line = [](const char* name, const std::string& words) {
    if (!words.empty()) std::printf("%-11s %s\n", name, words.c_str());
  };
  line("state", text("state"));
  line("measurement", text("measurement"));
  line("reason", text("reason"));
  for (const auto& finding : findings_from_json(reply.find("status"))) {
    line("finding", shown_text(with_advice(finding), most_said));
  }
  line("source", text("source") + ", " + text("device"));
  line("instrument", text("device_name"));
  line("frames",
       count_of(status, "frames") + ", " + count_of(status, "valid_frames") + " with a target");
  line("tags", count_of(status, "tags") + ", " + count_of(status, "lost_tags") + " lost");
  const std::string file = text_of(reply, "file");
  line("recording",
       (reply.find("recording") == "true" ? "yes" : "no") + (file.empty() ? "" : ": " + file));
  if (const std::string doing = text_of(reply, "doing"); !doing.empty()) {
    line("doing", doing + " " + text_of(reply, "progress"));
  }
}

// Puts the pattern file's name into a text of the daemon, which does not know that name and writes
// PATTERN.json.
std::string with_name(std::string text, const std::string& file) {
  constexpr std::string_view placeholder = "PATTERN.json";
  for (std::size_t at = 0; (at = text.find(placeholder, at)) != std::string::npos;) {
    text.replace(at, placeholder.size(), file);
    at += file.size();
  }
  return text;
}

void keep_pattern(const control::Reply& reply, const CtlCommand& options) {
  const Pattern pattern = pattern_from_json(reply.find("pattern"), "the daemon's reply");
  write_file(options.output, to_json_file(pattern));
  if (options.request.command == control::Command::calibrate && !options.json) {
    std::fputs(calibration::pulse_table(pattern).c_str(), stdout);
  }
}

void check_is_not_read(const CtlCommand& options) {
  if (options.config.empty()) return;
  OutputCheck outputs(load_config(options.config));
  outputs.may_replace("/pattern/file");
  outputs.check("--output", options.output);
}

int ctl(const CtlCommand& options) {
  if (!options.output.empty()) {
    check_may_write(options.output, options.force);
    check_is_not_read(options);
  }
  const control::Reply reply = ask(options);
  if (reply.fault) throw Error(*reply.fault, reply.message);
  if (!options.output.empty()) keep_pattern(reply, options);
  if (options.json) {
    std::printf("%s\n", to_json(reply).c_str());
  } else if (options.request.command == control::Command::status) {
    print_status(reply);
  }
  std::string said = with_name(reply.message, options.output);
  if (!said.empty() && said.back() != '\n') said += '\n';
  std::fputs(said.c_str(), stderr);
  return 0;
}

void add_output(CLI::App& command, CtlCommand& options, const char* what) {
  CLI::Option* output = command.add_option("--output,-o", options.output, what);
  if (command.get_name() == "calibrate") output->required();
  command.add_flag("--force", options.force, "Overwrite an existing file");
}

void add_calibrate_options(CLI::App& command, CtlCommand& options) {
  control::CalibrateRequest& request = options.request.calibrate;
  command
      .add_option("--seconds", request.seconds,
                  "Time to collect tags, s; splid does not measure meanwhile")
      ->required()
      ->check(number_between(0.1, 600));
  command
      .add_option(
          "--distance-m", request.distance_m,
          "Distance of the target at rest, m (default: later distances are relative to the target)")
      ->check(number_between(-calibration::farthest_target_m, calibration::farthest_target_m));
  command
      .add_option(
          "--time-ps", request.time_ps,
          "Required standard deviation of each pulse time, and largest motion of the target, ps")
      ->check(number_above_zero())
      ->capture_default_str();
  command
      .add_option("--amplitude-percent", request.amplitude_percent,
                  "Required standard deviation of each amplitude, percent of the mean amplitude")
      ->check(number_above_zero())
      ->capture_default_str();
  add_output(command, options, "Pattern file to write");
}

}  // namespace

void add_ctl(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("ctl", "Control a running splid");
  const auto options = std::make_shared<CtlCommand>();
  CLI::Option* endpoint = command->add_option(
      "--endpoint,-e", options->endpoint,
      "control.endpoint of the daemon (default: that of the service, or of this user)");
  command
      ->add_option("--config,-c", options->config,
                   "Configuration of the daemon, which names control.endpoint")
      ->excludes(endpoint);
  command->add_option("--key", options->key, "For tcp://: file of your secret key (splid keys)");
  command->add_option("--server-key", options->server_key,
                      "For tcp://: the server's public key, or its file");
  command->add_flag("--json", options->json, "Print the reply as a line of JSON");
  command->require_subcommand(1);
  const auto add = [&](CLI::App* parent, const char* name, control::Command asked,
                       const char* doc) {
    CLI::App* sub = parent->add_subcommand(name, doc)->fallthrough();
    sub->callback([&action, options, asked] {
      options->request.command = asked;
      action = [options] { return ctl(*options); };
    });
    return sub;
  };
  add(command, "status", control::Command::status, "Show the status");
  add(command, "start", control::Command::start, "Open the source and measure");
  add(command, "stop", control::Command::stop,
      "Stop measuring and close the source; splid keeps running");
  CLI::App* record = command->add_subcommand("record", "Start or end a recording");
  record->require_subcommand(1)->fallthrough();
  add(record, "start", control::Command::record_start, "Record the tags into record.folder");
  add(record, "stop", control::Command::record_stop, "End the recording");
  CLI::App* upload = add(command, "upload", control::Command::upload,
                         "Upload the pattern to the waveform generator");
  add_output(*upload, *options, "Pattern file to write, as played");
  CLI::App* calibrate = add(command, "calibrate", control::Command::calibrate,
                            "Find the pulses of the pattern from a target at rest");
  add_calibrate_options(*calibrate, *options);
}

}  // namespace splid
