#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <vector>

namespace splid::sockets {

// Passes bytes from one socket to another, in order. It takes more bytes only after all bytes taken
// before were sent on. So it holds one piece of bytes at most, and a slow receiver makes the sender
// wait.
//
// Threads: one. Both sockets are non-blocking and outlive this. Errors: none.
class Relay {
 public:
  enum class Result {
    idle,     // the sender has sent nothing more
    more,     // the sender may have sent more, but other connections have their turn first
    full,     // the receiver takes no more at present, or the relay is held
    ended,    // the sender has closed its end, and all its bytes were sent on
    broken,   // the receiver is gone
    refused,  // `inspect` refused a piece, which was not sent on
  };
  // Sees each piece of bytes before it is sent on, and may call hold(). False: the piece is
  // refused.
  using Inspect = std::function<bool(std::span<const std::byte>)>;

  Relay(int from, int to, Inspect inspect) : from_(from), to_(to), inspect_(std::move(inspect)) {}

  // Passes on what is there. scratch: room for a piece; its size is the longest piece.
  Result pump(std::span<std::byte> scratch);

  // Limits how many more bytes the relay takes, until the next call of allow().
  void allow(std::size_t bytes) { allowed_ = bytes; }
  // true: keeps the bytes taken so far and sends nothing on, until hold(false).
  void hold(bool held) { held_ = held; }
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

}  // namespace splid::sockets
