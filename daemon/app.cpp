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

// Words where a command should stand and none does, which CLI11 would only call unexpected.
void check_commands(const CLI::App& app, int argc, char** argv) {
  const CLI::App* command = &app;
  std::string so_far = "splid";
  for (int i = 1; i < argc && argv[i][0] != '-'; ++i) {
    const std::string word = argv[i];
    std::vector<std::string> names;
    const CLI::App* next = nullptr;
    for (const CLI::App* sub : command->get_subcommands(nullptr)) {
      names.push_back(sub->get_name());
      if (names.back() == word) next = sub;
    }
    if (names.empty()) return;
    if (next == nullptr) {
      std::vector<const char*> known;
      known.reserve(names.size());
      for (const std::string& name : names) known.push_back(name.c_str());
      std::string sentence = "no command '" + word + "'";
      sentence.append(suggest_name(word, known)).append(" (").append(so_far);
      throw Error(Fault::usage, sentence.append(" --help lists all)"));
    }
    command = next;
    so_far.append(" ").append(word);
  }
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
  check_commands(app, argc, argv);
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
