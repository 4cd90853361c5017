#include <unistd.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "config/config.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/service/session.hpp"
#include "daemon/service/start_check.hpp"
#include "daemon/service/stop_signals.hpp"
#include "daemon/stream/open_source.hpp"

namespace splid {

void add_run(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("run", "Measure from the configured source and publish, until Ctrl-C");
  const auto file = std::make_shared<std::string>();
  command->add_option("--config,-c", *file, "Configuration file")->required();
  add_log_options(*command);
  command->callback([&action, file] {
    action = [file] {
      // On a terminal a hangup means that the terminal was closed, so the program ends.
      StopSignals signals(::isatty(STDERR_FILENO) == 0);
      const Config config = load_config_aloud(*file);
      check_start(config);
      DeviceMonitor device;
      SessionOptions options;
      options.signals = &signals;
      options.is_service = true;
      return run_session(config, open_source(config, device.hears()), device, options,
                         signals.token());
    };
  });
}

}  // namespace splid
