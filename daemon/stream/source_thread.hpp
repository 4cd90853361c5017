#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <stop_token>
#include <thread>

#include "daemon/stream/ring.hpp"
#include "drivers/source.hpp"

namespace splid {

// Runs a source into a ring on a thread of its own and closes the ring when the stream ends, for
// whatever reason. A live source drops the newest when the ring is full, any other waits.
//
// Threads: the maker's. Errors: those of the source are kept for fault().
class SourceThread {
 public:
  // source, ring: outlive this. Starts at once. stop: ends the source.
  SourceThread(TagSource& source, TagRing& ring, std::stop_token stop);
  ~SourceThread();
  SourceThread(const SourceThread&) = delete;
  SourceThread& operator=(const SourceThread&) = delete;

  void join();
  // After join(): what ended the stream, null where it ended by itself or by the stop request.
  [[nodiscard]] std::exception_ptr fault() const { return fault_; }
  // Events that a live source had to drop because the ring was full; any thread.
  [[nodiscard]] std::uint64_t dropped_tags() const {
    return dropping_ ? dropping_->dropped_tags() : 0;
  }

 private:
  void run(TagSource& source, TagRing& ring, const std::stop_token& stop);

  std::stop_source destroyed_;
  std::unique_ptr<DroppingSink> dropping_;  // null where the source can wait
  std::exception_ptr fault_;                // written before the thread ends
  std::thread thread_;
};

}  // namespace splid
