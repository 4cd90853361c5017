#pragma once

#include <fstream>
#include <string>

namespace splid::test {

// Of /proc/PID/status, MiB of 2^20 bytes; 0 where there is none. key: "VmRSS", or "VmHWM" for the
// most so far.
inline double memory_mib(const std::string& key, const std::string& process = "self") {
  std::ifstream status("/proc/" + process + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind(key + ":", 0) == 0) return std::stod(line.substr(key.size() + 1)) / 1024;
  }
  return 0;
}

}  // namespace splid::test
