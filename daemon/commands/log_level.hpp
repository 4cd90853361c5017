#pragma once

#include <string>

namespace CLI {
class App;
}

namespace splid {

// Adds --log-level and -v to a subcommand: what goes to the log on standard error.
void add_log_options(CLI::App& command);

}  // namespace splid
