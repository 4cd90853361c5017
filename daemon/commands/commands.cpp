#include "daemon/commands/commands.hpp"

#include <CLI/CLI.hpp>

#include "config/config.hpp"
#include "daemon/base/log.hpp"

namespace splid {

void add_log_options(CLI::App& command) {
  static const CLI::IsMember names({"debug", "info", "warning", "error", "off"});
  command
      .add_option_function<std::string>(
          "--log-level", [](const std::string& name) { set_log_level(name); },
          "Least level of messages on standard error (default info)")
      ->check(names);
  command.add_flag_callback(
      "-v,--verbose", [] { set_log_level("debug"); }, "Same as --log-level debug");
}

Config load_config_aloud(const std::string& file) {
  Config config = load_config(file);
  for (const std::string& note : config.notes) log_warning(note);
  return config;
}

}  // namespace splid
