#include <pthread.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "config/config.hpp"
#include "config/pattern_file.hpp"
#include "daemon/base/log.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/service/session.hpp"
#include "daemon/service/start_check.hpp"
#include "daemon/service/stop_signals.hpp"
#include "daemon/stream/open_source.hpp"
#include "daemon/view/viewing.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

struct DemoCommand {
  std::string endpoint;  // empty: the configuration's
  std::string http = "127.0.0.1:9874";
};

// config/demo.json, but for ever: its ten seconds are for scripts/demo.
Config demo_config(const std::string& endpoint) {
  const std::string folder = shipped_folder();
  if (folder.empty()) {
    throw Error(Fault::usage,
                "demo.json, which splid demo measures, was not found: neither in share/splid of an "
                "installation that this program belongs to, nor in config/ of a repository that it "
                "was built in; install splid whole, or run a configuration of your own: splid run "
                "--config FILE beside splid view");
  }
  Config config = load_config_aloud(folder + "/demo.json");
  auto* scene = dynamic_cast<simulator::Options*>(config.source.get());
  if (scene == nullptr) {
    throw Error(Fault::usage, config.file + ": /source/driver: " + config.source_driver +
                                  " is given, but a demonstration has the simulator; start a "
                                  "measurement with splid run, and splid view beside it");
  }
  scene->seconds = 0;
  if (!endpoint.empty()) config.publish.endpoint = endpoint;
  return config;
}

// The page on a thread of its own. In this one command it shares a process with the measurement,
// since no measurement is there that a browser might harm.
class ViewThread {
 public:
  // signals: asked to stop where the page fails.
  ViewThread(const std::string& endpoint, const std::string& http, StopSignals& signals)
      : viewing_(endpoint, http, std::nullopt),
        thread_([this, &signals](const std::stop_token& stop) { run(stop, signals); }) {}

  // Ends the thread, and throws what ended it before.
  void end() {
    thread_.request_stop();
    thread_.join();
    if (fault_) std::rethrow_exception(fault_);
  }

 private:
  void run(const std::stop_token& stop, StopSignals& signals) {
    pthread_setname_np(pthread_self(), "view");
    try {
      viewing_.run(stop, [this](view::Viewing::State state, const std::string& words) {
        hear(state, words);
      });
    } catch (...) {
      fault_ = std::current_exception();
      signals.request_stop();
    }
  }

  // The address is printed when there is something to see.
  void hear(view::Viewing::State state, const std::string& words) const {
    if (state == view::Viewing::State::connected) {
      log_info("open {} in a browser; Ctrl-C ends the demonstration", viewing_.url());
    } else if (state != view::Viewing::State::pending) {
      log_warning(words);
    }
  }

  view::Viewing viewing_;
  std::exception_ptr fault_;  // the thread's until it is joined
  std::jthread thread_;
};

int demo(const DemoCommand& options) {
  StopSignals signals;
  const Config config = demo_config(options.endpoint);
  check_start(config);
  if (const std::string warning = view::who_can_read(options.http); !warning.empty()) {
    log_warning(warning);
  }
  ViewThread view(config.publish.endpoint, options.http, signals);
  DeviceMonitor device;
  SessionOptions session;
  session.other_endpoint =
      "give splid demo an endpoint of its own, such as --endpoint tcp://127.0.0.1:9882";
  const int code =
      run_session(config, open_source(config, device.hears()), device, session, signals.token());
  view.end();
  return code;
}

}  // namespace

void add_demo(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "demo", "Measure a simulated target and serve its live page, until Ctrl-C");
  const auto options = std::make_shared<DemoCommand>();
  command->add_option("--endpoint,-e", options->endpoint,
                      "Endpoint to publish on (default: that of demo.json)");
  command
      ->add_option("--http", options->http,
                   "HOST:PORT or PORT of the page; with port *, any free port")
      ->capture_default_str();
  add_log_options(*command);
  command->callback([&action, options] { action = [options] { return demo(*options); }; });
}

}  // namespace splid
