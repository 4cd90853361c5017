#pragma once

#include <sys/resource.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

namespace splid::test {

// While this lives, a process can open no file more: of the numbers below its limit none is free.
class FullTable {
 public:
  explicit FullTable(pid_t process) : process_(process) {
    std::vector<bool> used(1024, false);
    for (const auto& each :
         std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/fd")) {
      used.at(std::stoul(each.path().filename().string())) = true;
    }
    prlimit(process, RLIMIT_NOFILE, nullptr, &before_);
    rlimit limit = before_;
    limit.rlim_cur = static_cast<rlim_t>(std::find(used.begin(), used.end(), false) - used.begin());
    prlimit(process, RLIMIT_NOFILE, &limit, nullptr);
  }
  ~FullTable() { prlimit(process_, RLIMIT_NOFILE, &before_, nullptr); }
  FullTable(const FullTable&) = delete;
  FullTable& operator=(const FullTable&) = delete;

 private:
  pid_t process_;
  rlimit before_{};
};

}  // namespace splid::test
