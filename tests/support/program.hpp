#pragma once

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/temp_folder.hpp"

namespace splid::test {

// What a run of the built program came to.
struct ProgramResult {
  int exit_code = -1;  // 128 and more: ended by that signal less 128
  std::string out;
  std::string err;
};

inline std::string file_text(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// The built program, or another, running with the given arguments; ended when it goes out of scope.
class Program {
 public:
  explicit Program(std::vector<std::string> arguments, const std::string& file = SPLID_BINARY) {
    arguments.insert(arguments.begin(), file);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    const int how = O_WRONLY | O_CREAT | O_TRUNC;
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, out_.c_str(), how, 0600);
    posix_spawn_file_actions_addopen(&files, STDERR_FILENO, err_.c_str(), how, 0600);
    const int failed = posix_spawn(&process_, argv[0], &files, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    if (failed != 0) throw std::runtime_error("cannot start " + arguments.front());
  }
  ~Program() {
    if (process_ == 0) return;
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  [[nodiscard]] pid_t id() const { return process_; }
  void signal(int number) const { kill(process_, number); }

  [[nodiscard]] std::string out() const { return file_text(out_); }
  [[nodiscard]] std::string err() const { return file_text(err_); }

  ProgramResult wait() {
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = 0;
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return {code, out(), err()};
  }

 private:
  TempFolder folder_;
  std::string out_ = folder_.path("out");
  std::string err_ = folder_.path("err");
  pid_t process_ = 0;
};

inline ProgramResult run_program(const std::vector<std::string>& arguments) {
  return Program(arguments).wait();
}

}  // namespace splid::test
