#pragma once

#include <functional>
#include <string>

namespace CLI {
class App;
}

namespace splid {

struct Config;

// What the command line can ask for: one file of this folder for each subcommand, such as
// listen.cpp for `splid listen`. run_app() in app.cpp reads the command line and calls them.

// The whole program: reads the command line, does what it says and turns an error into a sentence
// on standard error and an exit code (0 done, 2 usage or configuration, 3 device, 4 data).
int run_app(int argc, char** argv);

// What a shell reports of a program that SIGINT ended. Commands whose result would be taken for
// whole by whoever waits, such as a cluster's queue, return it after a stop.
inline constexpr int stopped_exit_code = 130;

// What the command line asked for; returns the exit code. Errors: Error.
using Action = std::function<int()>;

// Each of these functions adds one subcommand, with its options, to `app`. Parsing a command line
// that names the subcommand sets `action`. `app` and `action` outlive the parsing.
void add_run(CLI::App& app, Action& action);
void add_simulate(CLI::App& app, Action& action);
void add_replay(CLI::App& app, Action& action);
void add_batch(CLI::App& app, Action& action);
void add_merge(CLI::App& app, Action& action);
void add_convert(CLI::App& app, Action& action);
void add_read_photon_hdf5(CLI::App& app, Action& action);
void add_record(CLI::App& app, Action& action);
void add_listen(CLI::App& app, Action& action);
void add_view(CLI::App& app, Action& action);
void add_demo(CLI::App& app, Action& action);
void add_check(CLI::App& app, Action& action);
void add_pattern(CLI::App& app, Action& action);
void add_calibrate(CLI::App& app, Action& action);
void add_cloud(CLI::App& app, Action& action);
void add_plot(CLI::App& app, Action& action);
void add_tradeoff(CLI::App& app, Action& action);
void add_devices(CLI::App& app, Action& action);
void add_bridge(CLI::App& app, Action& action);
void add_forward(CLI::App& app, Action& action);
void add_upload(CLI::App& app, Action& action);
void add_keys(CLI::App& app, Action& action);
void add_ctl(CLI::App& app, Action& action);

// Adds --log-level and -v to a subcommand: how much it logs on standard error.
void add_log_options(CLI::App& command);

// Reads the configuration as load_config() does, and logs its notes.
Config load_config_aloud(const std::string& file);

}  // namespace splid
