#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/security/handshake_watch.hpp"

namespace splid {

// The other end of a Publisher, for `listen`.
//
// Threads: one. Errors: the constructor throws Error(Fault::usage) for an endpoint that ZeroMQ
// cannot read. Connecting itself never fails: it is tried again until somebody is there and, once a
// second, until he lets this in.
class Subscriber {
 public:
  struct Message {
    std::string topic;
    std::string json;
  };

  // client: its keys; absent: it has none.
  Subscriber(const std::string& endpoint, const std::vector<std::string>& topics,
             const std::optional<CurveClient>& client = std::nullopt);
  ~Subscriber();
  Subscriber(const Subscriber&) = delete;
  Subscriber& operator=(const Subscriber&) = delete;

  // The next message; absent when none came within the time. Anything but two parts is passed over.
  std::optional<Message> receive(std::chrono::milliseconds timeout);

  // How the connection stands.
  HandshakeWatch::State state();

 private:
  struct Socket;
  void try_again();

  const std::string endpoint_;
  std::unique_ptr<Socket> socket_;
  std::int64_t tried_ns_ = 0;
};

}  // namespace splid
