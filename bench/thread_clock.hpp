#pragma once

#include <ctime>

namespace splid::bench {

// Time that this thread has run, whatever else the machine does; ms.
inline double thread_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

}  // namespace splid::bench
