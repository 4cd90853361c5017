#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "daemon/recording/frame_table.hpp"

namespace splid::recording {

// Writes the SHA-256 of each recording that is over into the table of its frames. A thread of its
// own, `checksum`, reads the recordings one after the other at the lowest priority, so that neither
// frames nor the recording of the moment wait for it.
//
// Threads: add() and finish() one at a time. Errors: none; failures are reported.
class Checksums {
 public:
  // Takes a sentence for people, on the checksums' thread or that of finish().
  using Say = std::function<void(const std::string&)>;

  explicit Checksums(Say say);
  ~Checksums();
  Checksums(const Checksums&) = delete;
  Checksums& operator=(const Checksums&) = delete;

  // table: with all its frames. recording: the file, to which nothing is written any more; where it
  // was removed meanwhile, its table stays without a checksum. Where 64 recordings wait already,
  // the disk is too slow to read them all, and the oldest stays without.
  void add(std::unique_ptr<FrameTable> table, std::string recording);

  // Waits for all checksums, but not longer than `patience` (absent: as long as it takes) nor after
  // a stop request. Says of which recordings they are missing. To be called once, last.
  void finish(const std::stop_token& stop, std::optional<std::chrono::milliseconds> patience = {});

 private:
  struct Entry {
    std::unique_ptr<FrameTable> table;
    std::string recording;
  };

  void run(const std::stop_token& stop);
  void write(const Entry& entry, const std::stop_token& stop);
  void give_up(const std::string& recording) const;

  Say say_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Entry> waiting_;  // guarded by mutex_; the first is being read
  std::jthread thread_;
};

}  // namespace splid::recording
