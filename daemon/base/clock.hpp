#pragma once

#include <cstdint>

namespace splid {

// The host's clocks, passed in so that a test can hold them still.
//
// Threads: any. Errors: none.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual double unix_s() const = 0;           // UTC
  [[nodiscard]] virtual std::int64_t steady_ns() const = 0;  // monotonic, zero is anywhere
};

// The machine's own.
const Clock& host_clock();

}  // namespace splid
