#include "daemon/service/stop_signals.hpp"

#include <pthread.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <utility>

namespace splid {
namespace {

constexpr int end_of_waiter = SIGUSR2;

// `timeout` signals its child and then the child's group, within some milliseconds. Nobody who
// finds a stop too slow is that quick.
constexpr std::chrono::milliseconds one_request{200};

sigset_t waited_for(bool hangup) {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, end_of_waiter);
  if (hangup) sigaddset(&set, SIGHUP);
  return set;
}

}  // namespace

StopSignals::StopSignals(bool takes_hangup) {
  std::signal(SIGPIPE, SIG_IGN);
  const sigset_t set = waited_for(takes_hangup);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  waiter_ = std::thread([this, set] { wait(set); });
}

StopSignals::~StopSignals() {
  over_ = true;
  pthread_kill(waiter_.native_handle(), end_of_waiter);
  waiter_.join();
}

void StopSignals::on_hangup(std::function<void()> action) {
  const std::scoped_lock lock(hangup_mutex_);
  hangup_ = std::move(action);
}

void StopSignals::wait(sigset_t signals) {
  pthread_setname_np(pthread_self(), "signals");
  std::chrono::steady_clock::time_point asked;
  for (int number = 0; sigwait(&signals, &number) == 0 && !over_;) {
    if (number == end_of_waiter) continue;  // from outside
    if (number == SIGHUP) {
      const std::scoped_lock lock(hangup_mutex_);
      if (hangup_) hangup_();
      continue;
    }
    const auto now = std::chrono::steady_clock::now();
    if (!stop_.stop_requested()) {
      asked = now;
      stop_.request_stop();
    } else if (now - asked > one_request) {
      std::_Exit(128 + number);
    }
  }
}

}  // namespace splid
