#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/patience.hpp"

namespace splid::test {

// The built program in a terminal of its own (a pseudo-terminal), as somebody at a keyboard runs
// it; ended when it goes out of scope.
class TerminalProgram {
 public:
  // environment: settings such as "LANG=C.UTF-8".
  TerminalProgram(std::vector<std::string> arguments, unsigned short columns, unsigned short rows,
                  std::vector<std::string> environment) {
    arguments.insert(arguments.begin(), SPLID_BINARY);
    // What a sanitizer is to pass over holds for this program too.
    for (const char* name : {"TSAN_OPTIONS", "ASAN_OPTIONS"}) {
      if (const char* value = std::getenv(name))
        environment.push_back(std::string(name) + '=' + value);
    }
    std::vector<char*> argv = pointers(arguments);
    std::vector<char*> envp = pointers(environment);
    master_ = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0) {
      throw std::runtime_error("no terminal");
    }
    // Held open, so that the terminal stays when the program is gone.
    slave_ = open(ptsname(master_), O_RDWR | O_NOCTTY | O_CLOEXEC);
    resize(columns, rows);
    process_ = fork();
    if (process_ != 0) return;
    setsid();
    ioctl(slave_, TIOCSCTTY, 0);
    for (const int standard : {0, 1, 2}) dup2(slave_, standard);
    execve(argv[0], argv.data(), envp.data());
    _exit(127);
  }
  ~TerminalProgram() {
    if (process_ != 0) {
      kill(process_, SIGKILL);
      waitpid(process_, nullptr, 0);
    }
    close(slave_);
    close(master_);
  }
  TerminalProgram(const TerminalProgram&) = delete;
  TerminalProgram& operator=(const TerminalProgram&) = delete;

  void resize(unsigned short columns, unsigned short rows) const {
    const winsize size{rows, columns, 0, 0};
    ioctl(master_, TIOCSWINSZ, &size);
  }
  void signal(int number) const { kill(process_, number); }
  void type(char key) const { (void)!write(master_, &key, 1); }

  [[nodiscard]] termios settings() const {
    termios now{};
    tcgetattr(slave_, &now);
    return now;
  }

  // Reads what the program writes until that is enough. Returns whether it was, within the patience
  // of a test.
  bool read_until(const std::function<bool()>& enough) {
    const auto end = std::chrono::steady_clock::now() + patience;
    while (!enough()) {
      if (std::chrono::steady_clock::now() > end) return false;
      read_some();
    }
    return true;
  }

  // All that it has written so far, or as far as read_until() has read it.
  [[nodiscard]] const std::string& written() const { return written_; }

  // The exit code; 128 and more: ended by that signal less 128. Reads on meanwhile.
  int wait() {
    int status = 0;
    read_until([&] { return waitpid(process_, &status, WNOHANG) == process_; });
    process_ = 0;
    read_some();
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

 private:
  static std::vector<char*> pointers(std::vector<std::string>& words) {
    std::vector<char*> all;
    for (std::string& word : words) all.push_back(word.data());
    all.push_back(nullptr);
    return all;
  }

  void read_some() {
    constexpr int slice_ms = 20;
    pollfd waiting{master_, POLLIN, 0};
    std::array<char, 4096> some{};
    while (poll(&waiting, 1, slice_ms) > 0 && (waiting.revents & POLLIN) != 0) {
      const ssize_t got = read(master_, some.data(), some.size());
      if (got <= 0) return;
      written_.append(some.data(), static_cast<std::size_t>(got));
    }
  }

  int master_ = -1;
  int slave_ = -1;
  pid_t process_ = 0;
  std::string written_;
};

}  // namespace splid::test
