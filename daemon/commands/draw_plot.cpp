#include "daemon/commands/draw_plot.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <fmt/ranges.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>

#include "daemon/base/file_descriptor.hpp"
#include "daemon/base/log.hpp"
#include "daemon/base/start_process.hpp"

namespace splid {
namespace {

std::vector<std::string> environment_of_python() {
  std::error_code unknown;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  const std::filesystem::path built = program.parent_path() / "python";
  if (unknown || !std::filesystem::exists(built / "splid/plots.py", unknown)) return {};
  const char* other = std::getenv("PYTHONPATH");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  return {"PYTHONPATH=" + built.string() + (other != nullptr ? std::string(":") + other : "")};
}

std::string all_of(int descriptor) {
  std::string text;
  std::array<char, 4096> block{};
  for (;;) {
    const ssize_t got = ::read(descriptor, block.data(), block.size());
    if (got == 0 || (got < 0 && errno != EINTR)) return text;
    if (got > 0) text.append(block.data(), static_cast<std::size_t>(got));
  }
}

// Where Python says what went wrong.
std::string last_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

struct Run {
  int exit_code = 0;
  std::string said;  // the last line on standard error
};

// python: a path, or a name that is looked for in PATH.
Run run_python(const std::string& python, const std::vector<std::string>& arguments) {
  constexpr int not_run = 127;
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    return {not_run, std::system_category().message(errno)};
  }
  const FileDescriptor reads(ends[0]);
  FileDescriptor writes(ends[1]);
  ProcessStart start;
  start.program = python;
  // -P: Python takes no module from the folder that the user is in.
  start.arguments = {python, "-P", "-m", "splid.plots"};
  start.arguments.insert(start.arguments.end(), arguments.begin(), arguments.end());
  start.environment = environment_of_python();
  start.error = writes.get();
  int status = 0;
  std::string said;
  try {
    const pid_t process = start_process(start);
    writes.reset();
    said = all_of(reads.get());
    while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
    }
  } catch (const std::system_error& error) {
    return {not_run, python + ": " + error.what()};
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  return {WIFEXITED(status) ? WEXITSTATUS(status) : not_run,
          said.empty() ? python + " ended without a word" : last_line(said)};
}

}  // namespace

std::optional<Error> try_to_draw(const std::vector<std::string>& arguments) {
  // The user's own Python may have the module, as where pip installed it. Debian's has it where its
  // package is installed, and is the Python that a build is made for.
  Run run;
  for (const char* python : {"python3", "/usr/bin/python3"}) {
    run = run_python(python, arguments);
    if (run.exit_code == 0) return std::nullopt;
    // The module itself has said what is wrong with its files; another Python would say the same.
    constexpr std::string_view module = "splid.plots: ";
    if (!run.said.starts_with(module)) continue;
    const bool is_known = run.exit_code >= static_cast<int>(Fault::usage) &&
                          run.exit_code <= static_cast<int>(Fault::data);
    return Error(is_known ? static_cast<Fault>(run.exit_code) : Fault::data,
                 run.said.substr(module.size()));
  }
  return Error(
      Fault::device,
      fmt::format("{}. With python3-splid and python3-matplotlib installed, this draws it: "
                  "python3 -m splid.plots {}",
                  run.said, fmt::join(arguments, " ")));
}

void draw_plot(const std::vector<std::string>& arguments) {
  const auto failed = try_to_draw(arguments);
  if (!failed) return log_info("the plot is in {}", arguments.back());
  log_warning("{} is not drawn: {}", arguments.back(), failed->what());
}

std::string table_of_plot(const std::string& picture) {
  return std::filesystem::path(picture).replace_extension(".csv").string();
}

}  // namespace splid
