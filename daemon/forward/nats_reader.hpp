#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>

#include "daemon/forward/broker.hpp"
#include "daemon/forward/nats_connection.hpp"

namespace splid::forward {

// The way back: what JetStream stores of a device, as it comes in.
//
// Threads: one; connections() any. Errors: none is thrown; what a broker does is logged, and tried
// again.
class NatsReader {
 public:
  using Sink = std::function<void(const std::string& topic, std::string json)>;

  NatsReader(Destination from, Sink sink);

  // Until `stop`. The sink gets each message of the device that the stream takes after the first
  // connection, in order and once, whatever becomes of the connection or the broker.
  void run(const std::stop_token& stop);

  [[nodiscard]] std::uint64_t connections() const { return connections_; }

 private:
  std::string connect();
  std::string take();
  void close();
  void tell(const std::string& fault);

  const Destination from_;
  const Sink sink_;
  Connection connection_;
  Context jet_stream_;
  Subscription messages_;
  std::uint64_t next_ = 0;  // in the stream, of all its devices; 0: not known yet
  std::atomic<std::uint64_t> connections_ = 0;
  std::string told_;  // last fault
};

}  // namespace splid::forward
