#include "daemon/commands/commands.hpp"

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>

#include "config/config.hpp"

namespace splid {

void add_log_options(CLI::App& command) {
  static const CLI::IsMember names({"debug", "info", "warning", "error", "off"});
  command
      .add_option_function<std::string>(
          "--log-level",
          [](const std::string& name) { spdlog::set_level(spdlog::level::from_str(name)); },
          "What to say on standard error (default info)")
      ->check(names);
  command.add_flag_callback(
      "-v,--verbose", [] { spdlog::set_level(spdlog::level::debug); }, "Same as --log-level debug");
}

Config load_config_aloud(const std::string& file) {
  Config config = load_config(file);
  if (!config.pattern_note.empty()) spdlog::warn("{}", config.pattern_note);
  return config;
}

}  // namespace splid
