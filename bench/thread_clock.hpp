#pragma once

#include <ctime>

namespace splid::bench {

// The time that this thread has run, in ms. It does not grow while other threads have the
// processor.
inline double thread_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

}  // namespace splid::bench
