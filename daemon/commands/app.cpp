#include <fmt/format.h>
#include <poll.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/commands/commands.hpp"
#include "daemon/security/curve_key.hpp"
#include "daemon/service/journal_log.hpp"
#include "daemon/service/memory.hpp"
#include "daemon/sockets/full_file_table.hpp"
#include "estimator/model/vector_level.hpp"
#include "protocol/error.hpp"
#include "protocol/nearest_name.hpp"
#include "protocol/shown_text.hpp"

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
  // On a terminal, erases the progress line that may stand there.
  const bool terminal = ::isatty(STDERR_FILENO) == 1;
  log->set_pattern((terminal ? "\r\033[K" : "") + std::string{"%H:%M:%S.%e %^%l%$: %v"});
  spdlog::set_default_logger(std::move(log));
}

// CLI11's error, reworded like the other errors of this program.
std::string parse_error_in_words(const CLI::ParseError& error) {
  std::string what = error.what();
  constexpr std::string_view unread = "Could not convert: ";
  if (what.starts_with(unread)) {
    return what.substr(unread.size()) + " is not a number; write it without a unit";
  }
  const std::size_t missing = what.find(" required ");
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr && what.ends_with("missing") &&
      missing != std::string::npos) {
    return what.substr(0, what.find(':')) + ": its value is missing";
  }
  return what;
}

// The words of the innermost command that was given, whose --help tells what is missing.
std::string given_command(const CLI::App& app) {
  std::string name = "splid";
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().front();
    name += " " + command->get_name();
  }
  return name;
}

// Whether standard output is a pipe whose reader has left, as head does. The errno of the write
// that failed for that may be long overwritten.
bool reader_has_left() {
  pollfd output{STDOUT_FILENO, POLLOUT, 0};
  return ::poll(&output, 1, 0) == 1 && (output.revents & (POLLERR | POLLHUP)) != 0;
}

// Writes out what is still in the buffer of standard output: only then does a full disk show.
int flushed(int exit_code) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return exit_code;
  if (errno == EPIPE || reader_has_left()) return exit_code;
  throw Error(Fault::device, std::string("standard output: ") + std::strerror(errno) +
                                 "; the output is incomplete");
}

std::string suggested(std::string_view word, const std::vector<std::string>& names) {
  std::vector<const char*> known;
  known.reserve(names.size());
  for (const std::string& name : names) known.push_back(name.c_str());
  return suggest_name(word, known);
}

bool is_list_of_numbers(std::string_view word) {
  return !word.empty() && word.find_first_not_of("0123456789.,") == std::string_view::npos;
}

// The words behind the program's name. One public key of 85 begins with '-', and would be taken for
// an option: a key behind --server-key becomes one word with it, "--server-key=KEY".
// And the lengths of a tradeoff become one word with commas: else the recording behind them would
// be one more length.
std::vector<std::string> command_words(int argc, char** argv) {
  std::vector<std::string> words;
  bool in_lengths = false;  // behind the first of them
  for (int i = 1; i < argc; ++i) {
    if (in_lengths && is_list_of_numbers(argv[i])) {
      words.back().append(",").append(argv[i]);
      continue;
    }
    in_lengths = !words.empty() && words.back() == "--lengths";
    if (!words.empty() && words.back() == "--server-key" && security::is_curve_key(argv[i])) {
      words.back().append("=").append(argv[i]);
    } else {
      words.emplace_back(argv[i]);
    }
  }
  return words;
}

// The command that the first words name. so_far: these words are appended to it.
const CLI::App* find_command(const CLI::App& app, const std::vector<std::string>& words,
                             std::string& so_far) {
  const CLI::App* command = &app;
  for (const std::string& word : words) {
    if (word.starts_with('-')) break;
    std::vector<std::string> names;
    const CLI::App* next = nullptr;
    for (const CLI::App* sub : command->get_subcommands(nullptr)) {
      names.push_back(sub->get_name());
      if (names.back() == word) next = sub;
    }
    if (names.empty()) break;
    if (next == nullptr) {
      std::string sentence = "no command '" + word + "'";
      sentence.append(suggested(word, names)).append(" (").append(so_far);
      throw Error(Fault::usage, sentence.append(" --help lists all)"));
    }
    command = next;
    so_far += " " + word;
  }
  return command;
}

// Adds the names of the options of a command and of all its subcommands.
void add_options(const CLI::App& command, std::vector<std::string>& names) {
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  for (const CLI::App* sub : command.get_subcommands(nullptr)) add_options(*sub, names);
}

// "--name" for "--name=value", "-n" for "-nvalue"; empty for a value such as -5.
std::string option_name(std::string_view word) {
  if (word.size() < 2 || word[0] != '-') return {};
  if (word[1] == '-') return std::string(word.substr(0, word.find('=')));
  return std::isalpha(static_cast<unsigned char>(word[1])) == 0 ? std::string{}
                                                                : std::string(word.substr(0, 2));
}

// An option of a command that stands before the command, as in "splid --config FILE run".
//
// Errors: Error(Fault::usage), which says where it belongs.
void check_order(const CLI::App& app, const std::vector<std::string>& words) {
  const std::string first = words.empty() ? std::string{} : option_name(words.front());
  if (first.empty() || first == "--" || app.get_option_no_throw(first) != nullptr) return;
  const auto commands = app.get_subcommands(nullptr);
  for (const std::string& word : words) {
    const auto command = std::find_if(commands.begin(), commands.end(),
                                      [&](const CLI::App* sub) { return sub->get_name() == word; });
    if (command == commands.end()) continue;
    std::vector<std::string> names;
    add_options(**command, names);
    if (std::find(names.begin(), names.end(), first) == names.end()) return;
    throw Error(Fault::usage, fmt::format("options stand behind the command; write splid {0} {1} "
                                          "... (splid {0} --help lists all)",
                                          word, first));
  }
}

// Checks the words of a command line before CLI11 reads it. CLI11 would call a mistyped command
// "unexpected", and after a mistyped option would complain that another option is missing.
//
// Errors: Error(Fault::usage) for an unknown command and for an option that the command does not
// have, each with the nearest known name.
void check_words(const CLI::App& app, const std::vector<std::string>& words) {
  std::string so_far = "splid";
  const CLI::App* command = find_command(app, words, so_far);
  std::vector<std::string> names;
  add_options(*command, names);
  for (const CLI::App* above = command->get_parent(); above != nullptr;
       above = above->get_parent()) {
    for (const CLI::Option* option : above->get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
  }
  for (const std::string& word : words) {
    const std::string name = option_name(word);
    if (name == "--") return;  // after "--" there are no options
    if (name.empty() || std::find(names.begin(), names.end(), name) != names.end()) continue;
    std::string sentence = "no option " + name;
    if (name.size() > 2) sentence.append(suggested(name, names));
    throw Error(Fault::usage, sentence.append(" (").append(so_far).append(" --help lists all)"));
  }
  check_order(app, words);
}

// SPLID_VECTOR_LEVEL names the widest vectors that are used.
//
// Errors: Error(Fault::usage) if the name is not that of a level that this processor runs.
void limit_vectors() {
  const char* wanted = std::getenv("SPLID_VECTOR_LEVEL");  // NOLINT(concurrency-mt-unsafe): no
                                                           // thread has been started
  if (wanted == nullptr || *wanted == 0) return;
  std::string known;
  for (const VectorLevel level : runnable_vector_levels()) {
    const std::string name = vector_level_name(level);
    if (name == wanted) {
      limit_vector_level(level);
      return;
    }
    known.append(known.empty() ? "" : ", ").append(name);
  }
  throw Error(Fault::usage,
              std::string("SPLID_VECTOR_LEVEL=") + wanted + ": this processor runs " + known);
}

int parse_and_run(int argc, char** argv) {
  limit_vectors();
  CLI::App app{"splid: a daemon for single-photon lidar", "splid"};
  app.set_version_flag("--version", std::string("splid " SPLID_VERSION " (search kernels: ") +
                                        vector_level_name(best_vector_level()) + ")");
  app.require_subcommand(0, 1);
  Action action;
  add_run(app, action);
  add_simulate(app, action);
  add_replay(app, action);
  add_batch(app, action);
  add_merge(app, action);
  add_convert(app, action);
  add_read_photon_hdf5(app, action);
  add_record(app, action);
  add_listen(app, action);
  add_view(app, action);
  add_demo(app, action);
  add_check(app, action);
  add_pattern(app, action);
  add_calibrate(app, action);
  add_cloud(app, action);
  add_plot(app, action);
  add_tradeoff(app, action);
  add_devices(app, action);
  add_bridge(app, action);
  add_forward(app, action);
  add_upload(app, action);
  add_keys(app, action);
  add_ctl(app, action);
  std::vector<std::string> words = command_words(argc, argv);
  check_words(app, words);
  try {
    std::reverse(words.begin(), words.end());  // CLI11 takes them from the end
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return flushed(app.exit(error));  // --help or --version
    throw Error(Fault::usage,
                parse_error_in_words(error) + " (" + given_command(app) + " --help lists all)");
  }
  if (!action) {
    std::fputs(app.help().c_str(), stderr);
    return usage_exit_code;
  }
  return flushed(action());
}

void print_error(const char* what) {
  const std::string text =
      std::string("splid: error: ").append(shown_text(what, most_said)).append("\n");
  std::fputs(error_lines(text, stderr_is_journal()).c_str(), stderr);
}

}  // namespace

int run_app(int argc, char** argv) {
  return_large_blocks();
  try {
    sockets::keep_spare_file();
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
