#include "daemon/service/stop_signals.hpp"

#include <pthread.h>

#include <csignal>
#include <cstdlib>
#include <utility>

namespace splid {
namespace {

constexpr int end_of_waiter = SIGUSR2;

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
  pthread_kill(waiter_.native_handle(), end_of_waiter);
  waiter_.join();
}

void StopSignals::on_hangup(std::function<void()> action) {
  const std::scoped_lock lock(hangup_mutex_);
  hangup_ = std::move(action);
}

void StopSignals::wait(sigset_t signals) {
  pthread_setname_np(pthread_self(), "signals");
  for (int number = 0; sigwait(&signals, &number) == 0 && number != end_of_waiter;) {
    if (number == SIGHUP) {
      const std::scoped_lock lock(hangup_mutex_);
      if (hangup_) hangup_();
      continue;
    }
    if (stop_.stop_requested()) std::_Exit(128 + number);
    stop_.request_stop();
  }
}

}  // namespace splid
