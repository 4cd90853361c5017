#pragma once

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>

#include "tests/support/local_connection.hpp"

namespace splid::test {

// ZMTP 3 by hand, of the mechanism NULL: says what no library would.
class ZmtpPeer {
 public:
  // socket: connected, closed by this. type: "SUB", "DEALER", ...
  ZmtpPeer(int socket, const std::string& type) : socket_(socket) {
    std::string greeting = std::string("\xff\0\0\0\0\0\0\0\1\x7f\3\0", 12) + "NULL";
    greeting.resize(64);
    send(greeting);
    send(frame(
        std::string("\5READY\x0bSocket-Type\0\0\0", 21) + static_cast<char>(type.size()) + type,
        command));
  }
  ~ZmtpPeer() { ::close(socket_); }
  ZmtpPeer(const ZmtpPeer&) = delete;
  ZmtpPeer& operator=(const ZmtpPeer&) = delete;

  static constexpr char more = 1;
  static constexpr char command = 4;

  static std::string frame(const std::string& body, char flags = 0) {
    constexpr std::size_t longest_short = 255;
    std::string bytes;
    if (body.size() <= longest_short) {
      bytes = std::string{flags, static_cast<char>(body.size())};
    } else {
      bytes = static_cast<char>(flags | 2);
      for (int shift = 56; shift >= 0; shift -= 8) bytes += static_cast<char>(body.size() >> shift);
    }
    return bytes + body;
  }
  static std::string subscription(const std::string& topic) { return frame('\1' + topic); }
  static std::string unsubscription(const std::string& topic) {
    return frame(std::string(1, '\0') + topic);
  }

  // False once the other end has closed. Takes what comes meanwhile, so that neither waits.
  bool send(const std::string& bytes) {
    for (std::size_t sent = 0; sent < bytes.size();) {
      pollfd waiting{socket_, static_cast<short>(POLLOUT | (reads ? POLLIN : 0)), 0};
      if (::poll(&waiting, 1, patience_ms) <= 0) return false;
      if ((waiting.revents & POLLIN) != 0 && !take()) return false;
      if ((waiting.revents & (POLLERR | POLLHUP)) != 0) return false;
      if ((waiting.revents & POLLOUT) == 0) continue;
      const ssize_t done =
          ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
      if (done < 0 && errno != EAGAIN) return false;
      if (done > 0) sent += static_cast<std::size_t>(done);
    }
    sent_bytes += bytes.size();
    return true;
  }
  // Until the other end has greeted and is ready for messages; false: it did not within the
  // patience.
  bool await_ready() {
    constexpr std::size_t greeting_bytes = 64;
    while (received.size() <= greeting_bytes) {
      pollfd waiting{socket_, POLLIN, 0};
      if (::poll(&waiting, 1, patience_ms) <= 0 || !take()) return false;
    }
    return true;
  }
  // Until the other end closes it; false: it did not within the patience.
  bool await_end() {
    for (;;) {
      pollfd waiting{socket_, POLLIN, 0};
      if (::poll(&waiting, 1, patience_ms) <= 0) return false;
      if (!take()) return true;
    }
  }

  bool reads = true;
  std::uint64_t sent_bytes = 0;
  std::string received;  // the first of it

 private:
  static constexpr int patience_ms = 60'000;

  bool take() {
    std::array<char, 65536> some{};
    const ssize_t got = ::recv(socket_, some.data(), some.size(), MSG_DONTWAIT);
    if (got <= 0) return got < 0 && errno == EAGAIN;
    if (received.size() < some.size()) received.append(some.data(), static_cast<std::size_t>(got));
    return true;
  }

  int socket_;
};

// A connected socket, for a ZmtpPeer to own.
inline int connect_to_port(int port) {
  const LocalConnection connection(port);
  return ::dup(connection.socket());
}

inline int connect_to_file(const std::string& file) {
  const int socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un place{};
  place.sun_family = AF_UNIX;
  file.copy(place.sun_path, sizeof place.sun_path - 1);
  (void)::connect(socket, reinterpret_cast<const sockaddr*>(&place), sizeof place);
  return socket;
}

}  // namespace splid::test
