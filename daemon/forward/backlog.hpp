#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "daemon/forward/message.hpp"

namespace splid::forward {

// The messages that wait for the broker, in order. Where they take more memory than allowed, the
// oldest are dropped, and a message of topic `gap` stands in their place and counts them.
//
// Threads: add() and counts() any; take() and done() one, which hands the messages on. No call
// waits but take().
class Backlog {
 public:
  // A batch: at most so many messages, of so many bytes unless one alone has more.
  static constexpr std::size_t most_messages = 128;
  static constexpr std::size_t most_batch_bytes = 1 << 20;

  // added == carried + lost + waiting
  struct Counts {
    std::uint64_t added = 0, carried = 0, lost = 0, waiting = 0;
    std::size_t bytes = 0;
  };

  // device: for the gap's id. most_bytes: of JSON, those of the batch that was taken included.
  Backlog(std::string device, std::size_t most_bytes);

  void add(Message message);

  // The oldest messages; empty where none came within the timeout. They belong to the backlog until
  // done() is called for each of them.
  std::vector<Message> take(std::chrono::milliseconds timeout);

  // The broker has the message, or refused it for good.
  void done(const Message& message, bool is_lost);

  [[nodiscard]] Counts counts() const;

 private:
  struct Lost {
    std::uint64_t count = 0, first_sequence = 0, last_sequence = 0;
    double first_s = 0, last_s = 0;  // their timestamps
  };
  static std::size_t size_of(const Message& message);
  void drop(const Message& message);
  Message make_gap();

  const std::string device_;
  const std::size_t most_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Message> queue_;
  std::map<std::string, Lost> gap_;  // of those dropped since the last gap message, by topic
  std::uint64_t gaps_ = 0;
  Counts counts_;
};

}  // namespace splid::forward
