#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/security/handshake_watch.hpp"

namespace splid {

// The client's end of a Publisher, for `splid listen`.
//
// Threads: one. Errors: the constructor throws Error(Fault::usage) for an endpoint that ZeroMQ
// cannot read. Connecting never fails: it is tried again until a daemon answers and, once a second,
// until the daemon lets this subscriber in.
class Subscriber {
 public:
  struct Message {
    std::string topic;
    std::string json;
  };

  // client: the subscriber's keys; absent: it has none.
  Subscriber(const std::string& endpoint, const std::vector<std::string>& topics,
             const std::optional<CurveClient>& client = std::nullopt);
  ~Subscriber();
  Subscriber(const Subscriber&) = delete;
  Subscriber& operator=(const Subscriber&) = delete;

  // The next message; absent when none came within the timeout. A message that has not two parts is
  // passed over.
  std::optional<Message> receive(std::chrono::milliseconds timeout);

  // The state of the connection.
  HandshakeWatch::State state();

 private:
  struct Socket;
  void try_again();

  const std::string endpoint_;
  std::unique_ptr<Socket> socket_;
  std::int64_t tried_ns_ = 0;
};

}  // namespace splid
