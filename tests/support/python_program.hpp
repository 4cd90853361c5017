#pragma once

#include <string>
#include <vector>

#include "tests/support/program.hpp"

namespace splid::test {

// A Python script of the source tree, run by Debian's Python, which has numpy, with the stand-ins
// for vendors' modules. environment: such as "NAME=value".
inline Program python(const std::string& script, const std::vector<std::string>& arguments,
                      const std::vector<std::string>& environment = {}) {
  std::vector<std::string> all = environment;
  all.insert(all.end(),
             {"PYTHONPATH=" SPLID_SOURCE_DIR "/tests/support/python", "PYTHONDONTWRITEBYTECODE=1",
              "/usr/bin/python3", SPLID_SOURCE_DIR "/" + script});
  all.insert(all.end(), arguments.begin(), arguments.end());
  return Program(all, "/usr/bin/env");
}

}  // namespace splid::test
