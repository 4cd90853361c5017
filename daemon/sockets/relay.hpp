#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <vector>

namespace splid {

// Bytes on their way from one socket to another, in order. Takes more only when all that it took
// has been sent on, so that it holds one piece at most and a receiver that waits makes the sender
// wait.
//
// Threads: one. Both sockets do not block and outlive this. Errors: none.
class Relay {
 public:
  enum class Result {
    idle,     // there is nothing to take now
    more,     // there may be; others have their turn first
    full,     // the receiver takes no more now, or it is held
    ended,    // the sender has ended and all of it is sent on
    broken,   // the receiver is gone
    refused,  // as `inspect` decided; the piece is not sent on
  };
  // Sees each piece before it is sent on; may call hold(). False: refused.
  using Inspect = std::function<bool(std::span<const std::byte>)>;

  Relay(int from, int to, Inspect inspect) : from_(from), to_(to), inspect_(std::move(inspect)) {}

  // scratch: the longest piece.
  Result pump(std::span<std::byte> scratch);

  // Takes that many bytes more and then waits for further notice.
  void allow(std::size_t bytes) { allowed_ = bytes; }
  // What was taken is kept until further notice.
  void hold(bool held) { held_ = held; }
  [[nodiscard]] bool is_full() const { return held_ || !pending_.empty(); }
  [[nodiscard]] bool is_held() const { return held_; }

 private:
  Result send(std::span<const std::byte> bytes);
  Result flush();

  int from_;
  int to_;
  Inspect inspect_;
  std::vector<std::byte> pending_;
  std::size_t allowed_ = std::numeric_limits<std::size_t>::max();
  bool held_ = false;
};

}  // namespace splid
