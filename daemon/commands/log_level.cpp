#include "daemon/commands/log_level.hpp"

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>

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

}  // namespace splid
