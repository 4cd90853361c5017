#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

namespace splid::test {

// The listening end of a bridge, for one client at a time.
class BridgeServer {
 public:
  // path: of a Unix socket; empty for TCP at a port that the system chooses.
  explicit BridgeServer(std::string path = {}) : path_(std::move(path)) {
    sockaddr_storage place{};
    place.ss_family = path_.empty() ? AF_INET : AF_UNIX;
    socklen_t bytes = sizeof(sockaddr_in);
    if (path_.empty()) {
      reinterpret_cast<sockaddr_in&>(place).sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    } else {
      path_.copy(reinterpret_cast<sockaddr_un&>(place).sun_path, sizeof sockaddr_un::sun_path - 1);
      bytes = sizeof(sockaddr_un);
    }
    listener_ = ::socket(place.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (::bind(listener_, reinterpret_cast<sockaddr*>(&place), bytes) != 0 ||
        ::listen(listener_, 4) != 0) {
      throw std::runtime_error("cannot listen");
    }
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&place), &bytes);
    port_ = ntohs(reinterpret_cast<sockaddr_in&>(place).sin_port);
  }
  ~BridgeServer() {
    hang_up();
    ::close(listener_);
    if (!path_.empty()) ::unlink(path_.c_str());
  }
  BridgeServer(const BridgeServer&) = delete;
  BridgeServer& operator=(const BridgeServer&) = delete;

  [[nodiscard]] std::string address() const {
    return path_.empty() ? "tcp:127.0.0.1:" + std::to_string(port_) : "unix:" + path_;
  }

  // False where nobody connects within the time.
  bool accept(int patience_ms = 120'000) {
    hang_up();
    pollfd entry{listener_, POLLIN, 0};
    if (::poll(&entry, 1, patience_ms) <= 0) return false;
    client_ = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    return client_ != -1;
  }
  // False where the client has gone.
  bool send(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(client_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return false;
      bytes = bytes.subspan(static_cast<std::size_t>(sent));
    }
    return true;
  }
  bool send(const std::string& text) { return send(std::as_bytes(std::span(text))); }
  void hang_up() {
    if (client_ != -1) ::close(std::exchange(client_, -1));
  }

 private:
  std::string path_;
  int listener_ = -1;
  int client_ = -1;
  unsigned port_ = 0;
};

}  // namespace splid::test
