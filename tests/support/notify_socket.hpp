#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "tests/support/patience.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::test {

// The service manager's end of sd_notify(3), and the environment that points to it while it lives.
// It takes what comes at once, as the manager does: a system may hold ten datagrams and no more,
// and who sends the next one waits.
class NotifySocket {
 public:
  explicit NotifySocket(const std::string& watchdog_us) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, file_.c_str(), sizeof(address.sun_path) - 1);
    descriptor_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (::bind(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error("cannot bind " + file_);
    }
    reading_ = std::jthread([this](const std::stop_token& stop) { read(stop); });
    ::setenv("NOTIFY_SOCKET", file_.c_str(), 1);
    ::setenv("WATCHDOG_USEC", watchdog_us.c_str(), 1);
  }
  ~NotifySocket() {
    ::unsetenv("NOTIFY_SOCKET");
    ::unsetenv("WATCHDOG_USEC");
    reading_ = {};
    ::close(descriptor_);
  }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  // The next datagram; empty where none came within the time.
  std::string next(std::chrono::milliseconds longest) {
    std::unique_lock lock(mutex_);
    if (!came_.wait_for(lock, longest, [this] { return !datagrams_.empty(); })) return "";
    std::string text = std::move(datagrams_.front());
    datagrams_.pop_front();
    return text;
  }

  // True once a datagram that holds `text` came, or the test's patience is at its end.
  bool hears(const std::string& text) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (std::chrono::steady_clock::now() < deadline) {
      if (next(std::chrono::milliseconds{100}).find(text) != std::string::npos) return true;
    }
    return false;
  }

  // Whether one that holds `text` comes within the time.
  bool hears_within(const std::string& text, std::chrono::milliseconds time) {
    const auto deadline = std::chrono::steady_clock::now() + time;
    while (std::chrono::steady_clock::now() < deadline) {
      if (next(std::chrono::milliseconds{20}).find(text) != std::string::npos) return true;
    }
    return false;
  }

 private:
  void read(const std::stop_token& stop) {
    const timeval between_looks{0, 20'000};
    ::setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &between_looks, sizeof between_looks);
    std::array<char, 8192> text{};
    while (!stop.stop_requested()) {
      const auto bytes = ::recv(descriptor_, text.data(), text.size(), 0);
      if (bytes <= 0) continue;
      const std::scoped_lock lock(mutex_);
      datagrams_.emplace_back(text.data(), static_cast<std::size_t>(bytes));
      came_.notify_all();
    }
  }

  TempFolder folder_;
  std::string file_ = folder_.path("notify");
  int descriptor_ = -1;
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<std::string> datagrams_;  // under the mutex
  std::jthread reading_;
};

}  // namespace splid::test
