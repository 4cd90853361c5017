#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "config/endpoint.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/security/key_file.hpp"
#include "daemon/service/stop_signals.hpp"
#include "daemon/sockets/subscriber.hpp"
#include "daemon/view/live_view.hpp"
#include "daemon/view/web_server.hpp"
#include "protocol/error.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/status_json.hpp"

namespace splid {
namespace {

struct ViewCommand {
  std::string endpoint = "tcp://127.0.0.1:9872";
  std::string http = "127.0.0.1:9874";
  std::string key;         // file of a secret key; empty: none
  std::string server_key;  // a public key or its file
};

std::optional<CurveClient> viewing_client(const ViewCommand& options) {
  if (options.key.empty() != options.server_key.empty()) {
    throw Error(Fault::usage,
                "--key and --server-key go together: who is asking, and whom; splid keys makes the "
                "first, the server's .key file is the second");
  }
  if (options.key.empty()) return std::nullopt;
  return CurveClient{asked_by("--key", [&] { return read_secret_key(options.key); }),
                     asked_by("--server-key", [&] { return read_public_key(options.server_key); })};
}

// One thread waits for the daemon's messages and for browsers alike. It is a process apart, so that
// no browser can touch a measurement.
class Viewing {
 public:
  explicit Viewing(const ViewCommand& options)
      : endpoint_(options.endpoint),
        client_(viewing_client(options)),
        subscriber_(options.endpoint, {topic_frame, topic_status, topic_version}, client_,
                    most_waiting),
        view_(options.endpoint),
        server_(options.http, view_, host_clock()) {}

  [[nodiscard]] std::string url() const { return server_.url(); }

  void run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      subscriber_.wait(server_.descriptor(), server_.patience());
      take_messages();
      look_at_connection();
      view_.set_web(server_.counts());
      server_.run();
    }
  }

 private:
  // Of a replay at full speed a part is lost rather than memory without bound; the frames'
  // `sequence` tells.
  static constexpr int most_waiting = 10'000;

  // As many as came, up to what takes some milliseconds: browsers are not kept waiting.
  void take_messages() {
    constexpr int most_at_once = 200;
    for (int i = 0; i < most_at_once; ++i) {
      const auto message = subscriber_.receive(std::chrono::milliseconds{0});
      if (!message) return;
      view_.take(message->topic, message->json);
    }
  }

  void look_at_connection() {
    using State = HandshakeWatch::State;
    const State state = subscriber_.state();
    if (state == said_) return;
    said_ = state;
    const std::string words = in_words(state, endpoint_, client_ ? &*client_ : nullptr);
    view_.set_connection(state == State::connected ? "" : words);
    if (state != State::pending) std::fprintf(stderr, "splid: %s\n", words.c_str());
  }

  std::string endpoint_;
  std::optional<CurveClient> client_;
  Subscriber subscriber_;
  LiveView view_;
  WebServer server_;
  std::optional<HandshakeWatch::State> said_;
};

int view(const ViewCommand& options) {
  const StopSignals signals;
  Viewing viewing(options);
  std::fprintf(stderr, "splid: the live view of %s is at %s\n", options.endpoint.c_str(),
               viewing.url().c_str());
  if (!is_on_this_machine("tcp://" + options.http)) {
    std::fprintf(stderr,
                 "splid: everybody who reaches %s over the network can read what is measured: the "
                 "page asks for no password and is not encrypted. With --http 127.0.0.1:9874 only "
                 "this machine can\n",
                 options.http.c_str());
  }
  viewing.run(signals.token());
  return 0;
}

}  // namespace

void add_view(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("view", "Show what a running splid publishes as a page for browsers");
  const auto options = std::make_shared<ViewCommand>();
  command->add_option("--endpoint,-e", options->endpoint, "The daemon's publish.endpoint")
      ->capture_default_str();
  command->add_option("--http", options->http, "HOST:PORT of the page; port *: any that is free")
      ->capture_default_str();
  command->add_option("--key", options->key, "File of your secret key (splid keys), for CURVE");
  command->add_option("--server-key", options->server_key,
                      "The server's public key, or its file, for CURVE");
  command->callback([&action, options] { action = [options] { return view(*options); }; });
}

}  // namespace splid
