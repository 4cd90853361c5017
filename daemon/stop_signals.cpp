#include "daemon/stop_signals.hpp"

#include <pthread.h>

#include <csignal>
#include <cstdlib>

namespace splid {
namespace {

constexpr int end_of_waiter = SIGUSR2;

sigset_t waited_for() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, end_of_waiter);
  return set;
}

}  // namespace

StopSignals::StopSignals() {
  std::signal(SIGPIPE, SIG_IGN);
  const sigset_t set = waited_for();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  waiter_ = std::thread([this] { wait(); });
}

StopSignals::~StopSignals() {
  pthread_kill(waiter_.native_handle(), end_of_waiter);
  waiter_.join();
}

void StopSignals::wait() {
  pthread_setname_np(pthread_self(), "signals");
  const sigset_t set = waited_for();
  for (int number = 0; sigwait(&set, &number) == 0 && number != end_of_waiter;) {
    if (stop_.stop_requested()) std::_Exit(128 + number);
    stop_.request_stop();
  }
}

}  // namespace splid
