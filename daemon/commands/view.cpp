#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "daemon/commands/commands.hpp"
#include "daemon/security/key_file.hpp"
#include "daemon/service/stop_signals.hpp"
#include "daemon/view/viewing.hpp"
#include "protocol/error.hpp"
#include "protocol/shown_text.hpp"

namespace splid {
namespace {

struct ViewCommand {
  std::string endpoint = "tcp://127.0.0.1:9872";
  std::string http = "127.0.0.1:9874";
  std::string key;         // file of a secret key; empty: none
  std::string server_key;  // a public key or its file
};

std::optional<security::CurveClient> viewing_client(const ViewCommand& options) {
  if (options.key.empty() != options.server_key.empty()) {
    throw Error(Fault::usage,
                "--key and --server-key go together: your secret key (splid keys makes it), and "
                "the server's .key file");
  }
  if (options.key.empty()) return std::nullopt;
  return security::CurveClient{
      asked_by("--key", [&] { return security::read_secret_key(options.key); }),
      asked_by("--server-key", [&] { return security::read_public_key(options.server_key); })};
}

int run_view(const ViewCommand& options) {
  const StopSignals signals;
  view::Viewing viewing(options.endpoint, options.http, viewing_client(options));
  std::fprintf(stderr, "splid: the live view of %s is at %s\n",
               shown_text(options.endpoint, most_said).c_str(), viewing.url().c_str());
  if (const std::string warning = view::who_can_read(options.http); !warning.empty()) {
    std::fprintf(stderr, "splid: %s\n", warning.c_str());
  }
  viewing.run(signals.token(), [](view::Viewing::State state, const std::string& words) {
    if (state != view::Viewing::State::pending) {
      std::fprintf(stderr, "splid: %s\n", shown_text(words, most_said).c_str());
    }
  });
  return 0;
}

}  // namespace

void add_view(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("view", "Serve a live page of a running splid for browsers");
  const auto options = std::make_shared<ViewCommand>();
  command->add_option("--endpoint,-e", options->endpoint, "The daemon's publish.endpoint")
      ->capture_default_str();
  command
      ->add_option("--http", options->http,
                   "HOST:PORT or PORT of the page; with port *, any free port")
      ->capture_default_str();
  command->add_option("--key", options->key, "File of your secret key (splid keys), for CURVE");
  command->add_option("--server-key", options->server_key,
                      "The server's public key, or its file, for CURVE");
  command->callback([&action, options] { action = [options] { return run_view(*options); }; });
}

}  // namespace splid
