#pragma once

#include <semaphore.h>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <ctime>

namespace splid {

// Lets one thread sleep until another says that there may be something to do. It carries no data
// and orders none: the sleeper looks at atomics of its own before it waits, and again after.
//
// Threads: notify() from any, also from a signal handler; wait_for() from one. No lock, no
// allocation.
//
// Design note: a POSIX semaphore and not std::atomic::wait, which has no time-out, nor
// std::counting_semaphore, whose timed wait in libstdc++ 12 polls. Its monotonic clock keeps a step
// of the host's UTC from holding a waiter up.
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
    // What was notified several times is one reason to look, not several.
    while (sem_trywait(&semaphore_) == 0) {
    }
  }

 private:
  sem_t semaphore_{};
};

}  // namespace splid
