#pragma once

#include <atomic>
#include <cstdint>

#include "daemon/base/clock.hpp"

namespace splid {

// A clock that stands still until it is told to go on.
//
// Threads: any.
class HeldClock final : public Clock {
 public:
  [[nodiscard]] double unix_s() const override {
    return 1.7e9 + static_cast<double>(now_ns_) / 1e9;
  }
  [[nodiscard]] std::int64_t steady_ns() const override { return now_ns_; }
  void advance_ms(std::int64_t ms) { now_ns_ += ms * 1'000'000; }

 private:
  std::atomic<std::int64_t> now_ns_{1'000'000'000};
};

}  // namespace splid
