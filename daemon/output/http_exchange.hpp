#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "daemon/base/file_descriptor.hpp"
#include "daemon/sockets/peer.hpp"

namespace splid {

// One request for the metrics, and its answer, on a connection that does not block.
//
// Threads: one. Errors: none.
class HttpExchange {
 public:
  HttpExchange(FileDescriptor socket, sockets::Peer peer, std::int64_t now_ns);

  // Reads and writes as far as that goes without waiting. text: gives the body of an answer.
  // Returns false when the exchange is over, answered or given up.
  bool go_on(const std::function<std::string()>& text, std::int64_t now_ns);

  [[nodiscard]] int socket() const { return socket_.get(); }
  [[nodiscard]] const sockets::Peer& peer() const { return peer_; }
  // Whether the request is whole, and the answer on its way.
  [[nodiscard]] bool answers() const { return !answer_.empty(); }

 private:
  bool read(const std::function<std::string()>& text, std::int64_t now_ns);
  bool write();

  FileDescriptor socket_;
  sockets::Peer peer_;
  std::int64_t end_ns_;
  std::string request_;
  std::string answer_;
  std::size_t sent_ = 0;
};

}  // namespace splid
