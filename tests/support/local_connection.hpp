#pragma once

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <string>

namespace splid::test {

// A connection to a port of this machine.
class LocalConnection {
 public:
  explicit LocalConnection(int port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    place.sin_port = htons(static_cast<std::uint16_t>(port));
    const timeval longest{120, 0};
    setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &longest, sizeof longest);
    (void)connect(socket_, reinterpret_cast<sockaddr*>(&place), sizeof place);
  }
  ~LocalConnection() { ::close(socket_); }
  LocalConnection(const LocalConnection&) = delete;
  LocalConnection& operator=(const LocalConnection&) = delete;

  [[nodiscard]] int socket() const { return socket_; }
  void send(const std::string& bytes) const {
    (void)!::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  // Until the other end closes, or that much silence.
  [[nodiscard]] std::string receive(int silence_ms = 60'000) const {
    const timeval longest{silence_ms / 1000, silence_ms % 1000 * 1000};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &longest, sizeof longest);
    std::string all;
    std::array<char, 4096> some{};
    for (ssize_t got = 0; (got = recv(socket_, some.data(), some.size(), 0)) > 0;) {
      all.append(some.data(), static_cast<std::size_t>(got));
    }
    return all;
  }

 private:
  int socket_;
};

}  // namespace splid::test
