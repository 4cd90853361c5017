#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

namespace splid::picoquant {

// Knows which call into the maker's library is under way, so that somebody else can tell that it
// hangs.
//
// Threads: enter() and leave() the caller's, overdue() any. Errors: none.
class CallWatch {
 public:
  // name: a literal.
  void enter(const char* name, std::chrono::milliseconds patience) {
    due_ns_.store(now_ns() + std::chrono::nanoseconds(patience).count(), std::memory_order_relaxed);
    name_.store(name, std::memory_order_release);
  }
  void leave() { name_.store(nullptr, std::memory_order_release); }

  // The call that has not returned within its patience; null where there is none.
  [[nodiscard]] const char* overdue() const {
    const char* name = name_.load(std::memory_order_acquire);
    return now_ns() > due_ns_.load(std::memory_order_relaxed) ? name : nullptr;
  }

 private:
  static std::int64_t now_ns() {
    return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
  }

  std::atomic<const char*> name_{nullptr};
  std::atomic<std::int64_t> due_ns_{0};
};

}  // namespace splid::picoquant
