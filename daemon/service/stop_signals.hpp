#pragma once

#include <atomic>
#include <csignal>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>

namespace splid {

// Turns SIGINT and SIGTERM into a stop request. A second signal, 200 ms after the first or later,
// ends the process at once, for people to whom the first was not enough.
//
// Threads: made before any other thread starts, so that all inherit the blocked signals. Also
// ignores SIGPIPE: a reader of standard output that leaves is an error of the write.
class StopSignals {
 public:
  // takes_hangup: SIGHUP calls what on_hangup() was given; otherwise it ends the process, as when a
  // terminal is closed.
  explicit StopSignals(bool takes_hangup = false);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  [[nodiscard]] std::stop_token token() const { return stop_.get_token(); }
  void request_stop() { stop_.request_stop(); }
  // action: what SIGHUP calls on the signals' thread, where it must not wait; null: nothing. A call
  // that is running has ended when this returns.
  void on_hangup(std::function<void()> action);

 private:
  void wait(sigset_t signals);

  std::stop_source stop_;
  std::mutex hangup_mutex_;
  std::function<void()> hangup_;
  std::atomic<bool> over_{false};
  std::thread waiter_;
};

}  // namespace splid
