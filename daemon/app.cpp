#include "daemon/app.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <vector>

#include "daemon/commands/commands.hpp"
#include "daemon/memory.hpp"
#include "protocol/error.hpp"
#include "protocol/nearest_name.hpp"

namespace splid {
namespace {

constexpr int usage_exit_code = static_cast<int>(Fault::usage);

void set_up_log() {
  auto log = spdlog::stderr_color_mt("splid");
  // On a terminal a progress line may stand there: erase it.
  const bool terminal = ::isatty(STDERR_FILENO) == 1;
  log->set_pattern((terminal ? "\r\033[K" : "") + std::string{"%H:%M:%S.%e %^%l%$: %v"});
  spdlog::set_default_logger(std::move(log));
}

// A first word that is neither an option nor a command, which CLI11 would only call unexpected.
void check_command(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands(nullptr)) names.push_back(command->get_name());
  std::vector<const char*> known;
  for (const std::string& name : names) {
    if (name == argv[1]) return;
    known.push_back(name.c_str());
  }
  throw Error(Fault::usage, std::string{"no command '"} + argv[1] + "'" +
                                suggest_name(argv[1], known) + " (splid --help lists all)");
}

int parse_and_run(int argc, char** argv) {
  CLI::App app{"splid: a daemon for single-photon lidar", "splid"};
  app.set_version_flag("--version", "splid " SPLID_VERSION);
  app.require_subcommand(0, 1);
  Action action;
  add_run(app, action);
  add_simulate(app, action);
  add_replay(app, action);
  add_record(app, action);
  add_listen(app, action);
  add_check(app, action);
  add_pattern(app, action);
  add_calibrate(app, action);
  add_tradeoff(app, action);
  add_devices(app, action);
  add_upload(app, action);
  add_keys(app, action);
  add_ctl(app, action);
  check_command(app, argc, argv);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : usage_exit_code;
  }
  if (!action) {
    std::fputs(app.help().c_str(), stderr);
    return usage_exit_code;
  }
  return action();
}

void print_error(const char* what) { std::fprintf(stderr, "splid: error: %s\n", what); }

}  // namespace

int run_app(int argc, char** argv) {
  return_large_blocks();
  try {
    set_up_log();
    return parse_and_run(argc, argv);
  } catch (const Error& error) {
    print_error(error.what());
    return error.exit_code();
  } catch (const std::bad_alloc&) {
    print_error(
        "not enough memory: lower /pipeline/ring_capacity_tags or /pipeline/estimation_threads, or "
        "allow more; docs/threads.md has what is needed");
    return static_cast<int>(Fault::device);
  } catch (const std::exception& error) {
    print_error(error.what());
    return static_cast<int>(Fault::device);
  }
}

}  // namespace splid
