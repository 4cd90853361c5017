#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "daemon/base/clock.hpp"
#include "daemon/forward/backlog.hpp"
#include "daemon/forward/broker.hpp"
#include "daemon/security/curve_key.hpp"
#include "daemon/sockets/subscriber.hpp"

namespace splid::forward {

struct Options {
  std::string endpoint;                         // the daemon's publish.endpoint
  std::optional<security::CurveClient> client;  // keys, where the daemon asks for them
  std::vector<std::string> topics;
  std::size_t most_bytes = 0;  // of messages that wait for the broker
  Destination to;
};

// Carries a daemon's messages to a broker. The caller's thread takes them from ZeroMQ; a thread of
// its own talks to the broker, so that a broker that hangs costs nothing but memory, up to the
// limit.
//
// Errors: the constructor throws as sockets::Subscriber's does; what a broker does is no error.
class Forwarding {
 public:
  explicit Forwarding(Options options);

  // Until `stop`, and for up to 2 s more where messages wait.
  void run(const std::stop_token& stop);

  [[nodiscard]] Backlog::Counts counts() const { return backlog_.counts(); }
  [[nodiscard]] std::uint64_t connections() const { return connections_; }

 private:
  void take_messages(const std::stop_token& stop);
  void carry(const std::stop_token& stop);
  void finish(const Broker::Outcome& outcome, std::vector<Message>& batch);
  void tell(const std::string& fault);
  void look_at_daemon();
  void report(const char* state);

  const Options options_;
  sockets::Subscriber subscriber_;
  Backlog backlog_;
  std::unique_ptr<Broker> broker_;
  std::atomic<std::uint64_t> connections_ = 0;  // to the broker, so far
  std::atomic<bool> is_connected_ = false;
  std::string told_;  // last fault of the broker
  std::optional<security::HandshakeWatch::State> said_;
  std::uint64_t reports_ = 0;
};

}  // namespace splid::forward
