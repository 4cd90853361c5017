#pragma once

#include <cstdint>

namespace splid {

// The room daemon/base holds what all other rooms of the daemon use: clocks, files, descriptors,
// progress lines and sentences for people.

// The host's clocks. They are passed to whoever needs the time, so that a test can hold them still.
//
// Threads: any. Errors: none.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual double unix_s() const = 0;           // UTC, seconds since 1970
  [[nodiscard]] virtual std::int64_t steady_ns() const = 0;  // monotonic, from an arbitrary zero
};

// The clocks of this machine.
const Clock& host_clock();

}  // namespace splid
