#pragma once

#include <cstddef>
#include <deque>
#include <mutex>
#include <string>
#include <utility>

namespace splid {

// A message on its way: two parts.
struct OutgoingMessage {
  std::string topic;
  std::string json;
};

// Messages that wait for the thread that sends them. The queue never waits: a message that does not
// fit is dropped and counted.
//
// Threads: any.
class OutgoingQueue {
 public:
  explicit OutgoingQueue(std::size_t capacity) : capacity_(capacity) {}

  // False where the queue was full.
  bool push(OutgoingMessage message) {
    const std::scoped_lock lock(mutex_);
    if (messages_.size() >= capacity_) {
      ++dropped_;
      return false;
    }
    messages_.push_back(std::move(message));
    return true;
  }
  // All messages that wait, in their order.
  [[nodiscard]] std::deque<OutgoingMessage> take() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(messages_, {});
  }
  [[nodiscard]] std::size_t dropped() const {
    const std::scoped_lock lock(mutex_);
    return dropped_;
  }

 private:
  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::deque<OutgoingMessage> messages_;  // guarded by mutex_
  std::size_t dropped_ = 0;               // guarded by mutex_
};

}  // namespace splid
