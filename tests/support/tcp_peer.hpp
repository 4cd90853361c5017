#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

namespace splid::test {

// Listens on a port of the system's choice and serves one connection after the other on a thread of
// its own, until it goes out of scope.
class TcpPeer {
 public:
  // serve: called with the connected socket, which is closed after it; to return when nothing is
  // readable() any more.
  using Serve = std::function<void(const TcpPeer& peer, int socket)>;
  explicit TcpPeer(Serve serve) : serve_(std::move(serve)) {
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* any = reinterpret_cast<sockaddr*>(&address);
    if (bind(listener_, any, size) != 0 || listen(listener_, 4) != 0) {
      throw std::runtime_error("no port");
    }
    getsockname(listener_, any, &size);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { run(); });
  }
  ~TcpPeer() {
    alive_ = false;
    thread_.join();
    close(listener_);
  }
  TcpPeer(const TcpPeer&) = delete;
  TcpPeer& operator=(const TcpPeer&) = delete;

  [[nodiscard]] std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

  // Until it goes out of scope.
  [[nodiscard]] bool alive() const { return alive_; }

  // Whether something can be read from the socket; false once this ends.
  [[nodiscard]] bool readable(int socket) const {
    constexpr int slice_ms = 10;
    pollfd waiting{socket, POLLIN, 0};
    while (alive_) {
      if (poll(&waiting, 1, slice_ms) > 0) return true;
    }
    return false;
  }

 private:
  void run() {
    while (readable(listener_)) {
      const int socket = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
      serve_(*this, socket);
      close(socket);
    }
  }

  Serve serve_;
  std::atomic<bool> alive_{true};
  int listener_ = -1;
  int port_ = 0;
  std::thread thread_;
};

}  // namespace splid::test
