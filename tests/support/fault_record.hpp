#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace splid::test {

// What came of a fault that a test injected. scripts/reliability makes the
// table faults.csv of docs/evidence/data of these lines.
struct FaultRecord {
  std::string fault;
  std::string said;     // state and reason, or what the frames showed
  double said_ms = -1;  // after the fault; negative: not measured
  std::string lost;
  double good_ms = -1;  // first good frame, after the fault or, where it lasts, its end
};

inline std::string in_ms(double ms) {
  return ms < 0 ? "" : std::to_string(static_cast<long long>(ms + 0.5)) + " ms";
}

inline void record(const FaultRecord& what) {
  std::printf("FAULT | %s | %s | %s | %s | %s |\n", what.fault.c_str(), what.said.c_str(),
              in_ms(what.said_ms).c_str(), what.lost.c_str(), in_ms(what.good_ms).c_str());
}

}  // namespace splid::test
