#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace splid {

// What the command line asked for; returns the exit code. Errors: Error.
using Action = std::function<int()>;

// Each adds one subcommand to `app`, with its options; when it is the one given, parsing sets
// `action`. Both outlive the parsing.
void add_run(CLI::App& app, Action& action);
void add_simulate(CLI::App& app, Action& action);
void add_replay(CLI::App& app, Action& action);
void add_record(CLI::App& app, Action& action);
void add_listen(CLI::App& app, Action& action);
void add_check(CLI::App& app, Action& action);
void add_pattern(CLI::App& app, Action& action);
void add_calibrate(CLI::App& app, Action& action);
void add_tradeoff(CLI::App& app, Action& action);
void add_devices(CLI::App& app, Action& action);
void add_upload(CLI::App& app, Action& action);
void add_keys(CLI::App& app, Action& action);
void add_ctl(CLI::App& app, Action& action);

}  // namespace splid
