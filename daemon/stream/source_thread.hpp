#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <stop_token>
#include <thread>

#include "daemon/stream/ring.hpp"
#include "drivers/source.hpp"

namespace splid {

// Runs a source on a thread of its own: the source's tags go into a ring, which is closed when the
// stream ends, for whatever reason. When the ring is full, a live source drops its newest tags and
// any other source waits.
//
// Threads: the thread that made it, for all calls but dropped_tags(). Errors: those of the source
// are kept for fault().
class SourceThread {
 public:
  // source, ring: outlive this. Starts at once. stop: ends the source.
  SourceThread(TagSource& source, TagRing& ring, std::stop_token stop);
  ~SourceThread();
  SourceThread(const SourceThread&) = delete;
  SourceThread& operator=(const SourceThread&) = delete;

  void join();
  // After join(): the error that ended the stream; null where the stream ended by itself or by the
  // stop request.
  [[nodiscard]] std::exception_ptr fault() const { return fault_; }
  // Events that a live source had to drop because the ring was full. Any thread may call it.
  [[nodiscard]] std::uint64_t dropped_tags() const {
    return dropping_ ? dropping_->dropped_tags() : 0;
  }

 private:
  void run(TagSource& source, TagRing& ring, const std::stop_token& stop);

  std::stop_source destroyed_;
  std::unique_ptr<DroppingSink> dropping_;  // null where the source can wait
  std::exception_ptr fault_;                // written by the thread before it ends
  std::thread thread_;
};

}  // namespace splid
