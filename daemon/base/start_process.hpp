#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace splid {

struct ProcessStart {
  std::string program;                   // a path, or a name that is looked for in PATH
  std::vector<std::string> arguments;    // with the name that the program sees as its own
  std::vector<std::string> environment;  // "NAME=value", instead of or beside this process's
  int output = -1;                       // becomes standard output; -1: stays this process's
  int error = -1;                        // becomes standard error; -1: stays this process's
};

// Starts a process, which gets the signals that this process waits for on a thread of its own.
// Returns its id, for waitpid().
//
// Threads: any. Errors: std::system_error.
pid_t start_process(const ProcessStart& start);

}  // namespace splid
