#pragma once

#include <chrono>
#include <cstdint>
#include <stop_token>

namespace splid {

// Lets the stream's time pass at a multiple of the steady clock's.
//
// Threads: one. Errors: none.
class Pace {
 public:
  // speed: stream time per real time, >= 0; 0 never waits. The stream's time 0 is now.
  explicit Pace(double speed);

  // Sleeps until the stream's time has come, and returns within some 5 ms of a stop request. False
  // once a stop was requested, even if there was nothing to wait for.
  bool wait_until(std::int64_t stream_ps, const std::stop_token& stop) const;

 private:
  double speed_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace splid
