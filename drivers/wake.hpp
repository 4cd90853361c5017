#pragma once

#include <semaphore.h>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <ctime>

namespace splid {

// Lets one thread sleep until another says that there may be something to do. A wake carries no
// data and puts none in order: the sleeper looks at its own atomics before it waits, and again
// after.
//
// Threads: notify() may be called from any, also from a signal handler; wait_for() from one thread.
// No lock, no allocation.
//
// Design note: a POSIX semaphore and not std::atomic::wait, which has no time-out, nor
// std::counting_semaphore, whose timed wait in libstdc++ 12 polls. It waits by the
// monotonic clock, so that a step of the host's UTC does not hold a waiter up.
class Wake {
 public:
  Wake() { sem_init(&semaphore_, 0, 0); }
  ~Wake() { sem_destroy(&semaphore_); }
  Wake(const Wake&) = delete;
  Wake& operator=(const Wake&) = delete;

  void notify() { sem_post(&semaphore_); }

  // Returns at a notify() since the last wait, or when the time is over.
  void wait_for(std::chrono::nanoseconds timeout) {
    timespec until{};
    clock_gettime(CLOCK_MONOTONIC, &until);
    constexpr std::int64_t ns_per_s = 1'000'000'000;
    const std::int64_t ns = until.tv_nsec + timeout.count();
    until.tv_sec += ns / ns_per_s;
    until.tv_nsec = ns % ns_per_s;
    while (sem_clockwait(&semaphore_, CLOCK_MONOTONIC, &until) == -1 && errno == EINTR) {
    }
    // Several notifications are one reason to look.
    while (sem_trywait(&semaphore_) == 0) {
    }
  }

 private:
  sem_t semaphore_{};
};

}  // namespace splid
