#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>

#include "tests/support/temp_folder.hpp"

namespace splid::test {

// The service manager's end of sd_notify(3), and the environment that points to it while it lives.
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
    ::setenv("NOTIFY_SOCKET", file_.c_str(), 1);
    ::setenv("WATCHDOG_USEC", watchdog_us.c_str(), 1);
  }
  ~NotifySocket() {
    ::unsetenv("NOTIFY_SOCKET");
    ::unsetenv("WATCHDOG_USEC");
    ::close(descriptor_);
  }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  // The next datagram; empty where none came within the time.
  std::string next(std::chrono::milliseconds patience) const {
    const timeval time{patience.count() / 1000, (patience.count() % 1000) * 1000};
    ::setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &time, sizeof time);
    std::array<char, 8192> text{};
    const auto bytes = ::recv(descriptor_, text.data(), text.size(), 0);
    return bytes > 0 ? std::string(text.data(), static_cast<std::size_t>(bytes)) : "";
  }

  // True once a datagram that holds `text` came, at the latest after 20 s.
  bool hears(const std::string& text) const {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds{20};
    while (std::chrono::steady_clock::now() < deadline) {
      if (next(std::chrono::milliseconds{100}).find(text) != std::string::npos) return true;
    }
    return false;
  }

  // Whether one that holds `text` comes within the time.
  bool hears_within(const std::string& text, std::chrono::milliseconds time) const {
    const auto deadline = std::chrono::steady_clock::now() + time;
    while (std::chrono::steady_clock::now() < deadline) {
      if (next(std::chrono::milliseconds{20}).find(text) != std::string::npos) return true;
    }
    return false;
  }

 private:
  TempFolder folder_;
  std::string file_ = folder_.path("notify");
  int descriptor_ = -1;
};

}  // namespace splid::test
