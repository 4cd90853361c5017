#include "daemon/base/start_process.hpp"

#include <spawn.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <string_view>
#include <system_error>

namespace splid {
namespace {

// What posix_spawn() takes, freed again whatever happens.
class SpawnFacts {
 public:
  SpawnFacts() {
    posix_spawn_file_actions_init(&files);
    posix_spawnattr_init(&attributes);
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  }
  ~SpawnFacts() {
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
  }
  SpawnFacts(const SpawnFacts&) = delete;
  SpawnFacts& operator=(const SpawnFacts&) = delete;

  void become(int from, int to) {
    if (from >= 0) posix_spawn_file_actions_adddup2(&files, from, to);
  }

  posix_spawn_file_actions_t files{};
  posix_spawnattr_t attributes{};
};

std::string_view name_of_variable(std::string_view variable) {
  return variable.substr(0, variable.find('='));
}

std::vector<std::string> environment_with(const std::vector<std::string>& changed) {
  std::vector<std::string> all = changed;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const auto is_changed = [&](const std::string& other) {
      return name_of_variable(other) == name_of_variable(*variable);
    };
    if (std::none_of(changed.begin(), changed.end(), is_changed)) all.emplace_back(*variable);
  }
  return all;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> all;
  all.reserve(texts.size() + 1);
  for (std::string& text : texts) all.push_back(text.data());
  all.push_back(nullptr);
  return all;
}

}  // namespace

pid_t start_process(const ProcessStart& start) {
  SpawnFacts facts;
  facts.become(start.output, STDOUT_FILENO);
  facts.become(start.error, STDERR_FILENO);
  std::vector<std::string> arguments = start.arguments;
  std::vector<std::string> environment = environment_with(start.environment);
  pid_t process = -1;
  const int error = ::posix_spawnp(&process, start.program.c_str(), &facts.files, &facts.attributes,
                                   pointers(arguments).data(), pointers(environment).data());
  if (error != 0) throw std::system_error(error, std::generic_category());
  return process;
}

}  // namespace splid
