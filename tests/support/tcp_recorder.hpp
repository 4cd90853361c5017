#pragma once

#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <mutex>
#include <string>
#include <vector>

#include "tests/support/local_connection.hpp"
#include "tests/support/tcp_peer.hpp"

namespace splid::test {

// Stands between a client and a server on this machine and keeps every byte that the client sends,
// as somebody on the network between them could.
class TcpRecorder {
 public:
  explicit TcpRecorder(int server_port)
      : peer_([this, server_port](const TcpPeer& peer, int client) {
          pass_on(peer, client, server_port);
        }) {}

  [[nodiscard]] std::string address() const { return peer_.address(); }

  // What the client sent, in the pieces in which it came, since a server may wait for an answer
  // between them.
  [[nodiscard]] std::vector<std::string> sent_by_client() const {
    const std::scoped_lock lock(mutex_);
    return sent_;
  }

 private:
  void pass_on(const TcpPeer& peer, int client, int server_port) {
    constexpr int slice_ms = 10;
    const LocalConnection server(server_port);
    std::array<pollfd, 2> ends{{{client, POLLIN, 0}, {server.socket(), POLLIN, 0}}};
    while (peer.alive()) {
      if (poll(ends.data(), ends.size(), slice_ms) <= 0) continue;
      if (ends[0].revents != 0 && !pass_on(client, server.socket(), true)) return;
      if (ends[1].revents != 0 && !pass_on(server.socket(), client, false)) return;
    }
  }

  // What has come; false at the end of the stream.
  bool pass_on(int from, int to, bool is_kept) {
    std::array<char, 4096> bytes{};
    const ssize_t got = recv(from, bytes.data(), bytes.size(), 0);
    if (got <= 0) return false;
    const auto count = static_cast<std::size_t>(got);
    if (is_kept) {
      const std::scoped_lock lock(mutex_);
      sent_.emplace_back(bytes.data(), count);
    }
    return ::send(to, bytes.data(), count, MSG_NOSIGNAL) == got;
  }

  mutable std::mutex mutex_;
  std::vector<std::string> sent_;  // guarded by mutex_
  TcpPeer peer_;                   // its thread uses the above
};

}  // namespace splid::test
