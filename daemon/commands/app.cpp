#include "daemon/commands/app.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <string_view>

#include "daemon/commands/commands.hpp"
#include "daemon/commands/word_check.hpp"
#include "daemon/service/journal_log.hpp"
#include "daemon/service/memory.hpp"
#include "daemon/sockets/full_file_table.hpp"
#include "estimator/fold/vector_level.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

constexpr int usage_exit_code = static_cast<int>(Fault::usage);

void set_up_log() {
  auto log = spdlog::stderr_color_mt("splid");
  if (stderr_is_journal()) {
    log->set_formatter(journal_formatter());
    spdlog::set_default_logger(std::move(log));
    return;
  }
  // On a terminal a progress line may stand there: erase it.
  const bool terminal = ::isatty(STDERR_FILENO) == 1;
  log->set_pattern((terminal ? "\r\033[K" : "") + std::string{"%H:%M:%S.%e %^%l%$: %v"});
  spdlog::set_default_logger(std::move(log));
}

// CLI11's own sentence, in the manner of the program's others.
std::string in_words(const CLI::ParseError& error) {
  std::string what = error.what();
  constexpr std::string_view unread = "Could not convert: ";
  if (what.starts_with(unread)) {
    return what.substr(unread.size()) + " is no number that can be read; write it without a unit";
  }
  const std::size_t missing = what.find(" required ");
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr && what.ends_with("missing") &&
      missing != std::string::npos) {
    return what.substr(0, what.find(':')) + ": its value is missing";
  }
  return what;
}

// The innermost command that was given: its --help has what is missing.
std::string given_command(const CLI::App& app) {
  std::string name = "splid";
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().front();
    name += " " + command->get_name();
  }
  return name;
}

// What was printed may wait in a buffer still, for a disk that is full.
int flushed(int exit_code) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return exit_code;
  if (errno == EPIPE) return exit_code;
  throw Error(Fault::device, std::string("standard output: ") + std::strerror(errno) +
                                 "; what was printed is not all there");
}

int parse_and_run(int argc, char** argv) {
  CLI::App app{"splid: a daemon for single-photon lidar", "splid"};
  app.set_version_flag("--version", std::string("splid " SPLID_VERSION " (search kernels: ") +
                                        vector_level_name(best_vector_level()) + ")");
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
  check_words(app, argc, argv);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return flushed(app.exit(error));  // help, version
    throw Error(Fault::usage, in_words(error) + " (" + given_command(app) + " --help lists all)");
  }
  if (!action) {
    std::fputs(app.help().c_str(), stderr);
    return usage_exit_code;
  }
  return flushed(action());
}

void print_error(const char* what) {
  const std::string text = std::string("splid: error: ").append(what).append("\n");
  std::fputs(error_lines(text, stderr_is_journal()).c_str(), stderr);
}

}  // namespace

int run_app(int argc, char** argv) {
  return_large_blocks();
  try {
    keep_spare_file();
    set_up_log();
    return parse_and_run(argc, argv);
  } catch (const Error& error) {
    print_error(error.what());
    return error.exit_code();
  } catch (const std::bad_alloc&) {
    print_error(
        "not enough memory: lower /pipeline/ring_capacity_tags or /pipeline/estimation_threads, or "
        "allow more; docs/reference/configuration.md has what is needed");
    return static_cast<int>(Fault::device);
  } catch (const std::exception& error) {
    print_error(error.what());
    return static_cast<int>(Fault::device);
  }
}

}  // namespace splid
