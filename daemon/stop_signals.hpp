#pragma once

#include <stop_token>
#include <thread>

namespace splid {

// Turns SIGINT and SIGTERM into a stop request. A second one ends the process at once, for when the
// first is not enough.
//
// Threads: made before any other thread starts, so that all inherit the blocked signals. Also
// ignores SIGPIPE: a reader of standard output that leaves is an error of the write.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  [[nodiscard]] std::stop_token token() const { return stop_.get_token(); }
  void request_stop() { stop_.request_stop(); }

 private:
  void wait();

  std::stop_source stop_;
  std::thread waiter_;
};

}  // namespace splid
