#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/base/text.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/number_check.hpp"
#include "daemon/forward/forwarding.hpp"
#include "daemon/forward/nats_reader.hpp"
#include "daemon/output/publisher.hpp"
#include "daemon/security/key_file.hpp"
#include "daemon/service/stop_signals.hpp"
#include "protocol/error.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/scene_json.hpp"
#include "protocol/shown_text.hpp"
#include "protocol/status_json.hpp"

namespace splid {
namespace {

constexpr double bytes_per_buffer_mib = 1 << 20;
constexpr double most_buffer_mib = 65536;

// With --back, of each subscriber: what comes at once after an hour without the broker.
constexpr int most_waiting_back = 100'000;

struct ForwardCommand {
  std::string endpoint = "tcp://127.0.0.1:9872";
  std::string to;
  std::vector<std::string> topics = {topic_status, topic_frame, topic_scene};
  std::string device;  // empty: this machine's name
  double buffer_mib = 64;
  std::string credentials;
  std::string ca;
  std::string certificate;
  std::string private_key;
  std::string key;         // file of a secret key; empty: none
  std::string server_key;  // a public key or its file
  bool back = false;
};

// This machine's name up to its first dot.
std::string default_device() {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return {};
  const std::string whole = name.data();
  return whole.substr(0, whole.find('.'));
}

void check_device(const std::string& device) {
  const bool is_fit =
      !device.empty() && std::all_of(device.begin(), device.end(), [](unsigned char c) {
        return std::isalnum(c) != 0 || c == '-' || c == '_';
      });
  if (is_fit) return;
  throw Error(Fault::usage, "--device '" + shown_text(device, most_said) +
                                "': is part of each topic: give letters, digits, - and _ alone");
}

forward::Destination destination_of(const ForwardCommand& command) {
  forward::Destination to = forward::parse_destination(command.to, !command.ca.empty());
  to.device = command.device.empty() ? default_device() : command.device;
  check_device(to.device);
  if (command.certificate.empty() != command.private_key.empty() ||
      (command.ca.empty() && !command.certificate.empty())) {
    throw Error(Fault::usage,
                "--certificate and --private-key go together, and with --ca, which turns TLS on");
  }
  to.ca = command.ca;
  to.certificate = command.certificate;
  to.private_key = command.private_key;
  if (!command.credentials.empty()) {
    asked_by("--credentials", [&] {
      forward::read_credentials(command.credentials, to);
      return 0;
    });
  }
  return to;
}

std::optional<security::CurveClient> daemon_client(const ForwardCommand& command) {
  if (command.key.empty() != command.server_key.empty()) {
    throw Error(Fault::usage,
                "--key and --server-key go together: your secret key (splid keys makes it), and "
                "the server's .key file");
  }
  if (command.key.empty()) return std::nullopt;
  return security::CurveClient{
      asked_by("--key", [&] { return security::read_secret_key(command.key); }),
      asked_by("--server-key", [&] { return security::read_public_key(command.server_key); })};
}

// The other way: listen, view and Python hear the device as they hear a daemon.
int run_back(const ForwardCommand& command) {
  const StopSignals signals;
  const forward::Destination from = destination_of(command);
  if (!from.is_nats) {
    throw Error(Fault::usage, "--back reads JetStream alone: give --to nats://HOST:PORT");
  }
  Publisher publisher(command.endpoint, most_waiting_back);
  std::uint64_t count = 0;
  forward::NatsReader reader(from, [&](const std::string& topic, std::string json) {
    const auto& topics = command.topics;
    if (std::find(topics.begin(), topics.end(), topic) == topics.end()) return;
    ++count;
    if (topic == topic_frame) {
      publisher.publish_frame(std::move(json));
    } else if (topic == topic_scene) {
      publisher.publish_scene(std::move(json));
    } else if (topic == topic_status) {
      publisher.publish_status(std::move(json));
    }
  });
  reader.run(signals.token());
  std::fprintf(stderr, "splid: %s messages published; %s connections to the broker\n",
               grouped(count).c_str(), grouped(reader.connections()).c_str());
  return 0;
}

int run_forward(const ForwardCommand& command) {
  if (command.back) return run_back(command);
  const StopSignals signals;
  forward::Options options;
  options.endpoint = command.endpoint;
  options.client = daemon_client(command);
  options.topics = command.topics;
  options.most_bytes = static_cast<std::size_t>(command.buffer_mib * bytes_per_buffer_mib);
  options.to = destination_of(command);
  forward::Forwarding forwarding(std::move(options));
  forwarding.run(signals.token());
  const forward::Backlog::Counts counts = forwarding.counts();
  std::fprintf(stderr, "splid: %s messages carried, %s lost; %s connections to the broker\n",
               grouped(counts.carried).c_str(), grouped(counts.lost + counts.waiting).c_str(),
               grouped(forwarding.connections()).c_str());
  return 0;
}

void add_broker_options(CLI::App& command, ForwardCommand& options) {
  command.add_option("--to", options.to, "The broker: mqtt://HOST:PORT or nats://HOST:PORT")
      ->required();
  command.add_option("--device", options.device,
                     "The sensor's name in the topics (default: this machine's name)");
  command
      .add_option("--buffer", options.buffer_mib,
                  "MiB of messages that wait while the broker is away; then the oldest are lost, "
                  "and counted")
      ->check(number_above_zero(most_buffer_mib))
      ->capture_default_str();
  command.add_option("--credentials", options.credentials,
                     "File with USER:PASSWORD, or of NATS credentials");
  command.add_option("--ca", options.ca, "File of certificates that the broker is checked by: TLS");
  command.add_option("--certificate", options.certificate, "With --ca: this client's certificate");
  command.add_option("--private-key", options.private_key, "With --ca: this client's private key");
}

}  // namespace

void add_forward(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "forward", "Carry what a running splid publishes to an MQTT broker or to NATS JetStream");
  const auto options = std::make_shared<ForwardCommand>();
  add_broker_options(*command, *options);
  command
      ->add_option("--endpoint,-e", options->endpoint,
                   "The daemon's publish.endpoint; with --back, where splid listen connects to")
      ->capture_default_str();
  command->add_option("--topics", options->topics, "status,frame,scene, or a part of them")
      ->delimiter(',')
      ->check(CLI::IsMember({topic_status, topic_frame, topic_scene}));
  command->add_option("--key", options->key, "File of your secret key (splid keys), for CURVE");
  command->add_option("--server-key", options->server_key,
                      "The server's public key, or its file, for CURVE");
  command
      ->add_flag("--back", options->back,
                 "The other way: publish at --endpoint what JetStream stores of the device")
      ->excludes("--buffer")
      ->excludes("--key");
  add_log_options(*command);
  command->callback([&action, options] { action = [options] { return run_forward(*options); }; });
}

}  // namespace splid
