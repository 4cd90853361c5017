#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <list>
#include <string>
#include <thread>

#include "daemon/base/clock.hpp"
#include "daemon/base/wake_descriptor.hpp"
#include "daemon/output/http_exchange.hpp"
#include "daemon/security/refusals.hpp"
#include "daemon/sockets/listening_socket.hpp"

namespace splid {

// Answers GET /metrics over HTTP, one request on each connection. A client that sends no whole
// request keeps its connection for a second, and loses it earlier to the next client when there are
// many.
//
// Threads: one of its own answers. Errors: the constructor throws Error(Fault::device) where the
// port cannot be had. Timeouts: the destructor waits for an answer that is being written.
class MetricsServer {
 public:
  static constexpr std::size_t most_connections = 32;

  // address: HOST:PORT, the port "*" is the system's choice. text: what is answered, called on the
  // server's thread. refusals: hears who was in the way; null: nobody does. clock: outlives this.
  MetricsServer(const std::string& address, std::function<std::string()> text,
                security::Refusals* refusals, const Clock& clock);
  ~MetricsServer();
  MetricsServer(const MetricsServer&) = delete;
  MetricsServer& operator=(const MetricsServer&) = delete;

  // The address as it is bound.
  [[nodiscard]] std::string url() const;

 private:
  void run();
  void wait();
  void accept_some();
  bool make_room(const sockets::Peer& peer);
  void serve();

  sockets::ListeningSocket listener_;
  std::function<std::string()> text_;
  security::Refusals* refusals_;
  const Clock& clock_;
  WakeDescriptor wake_;
  std::list<HttpExchange> exchanges_;  // the thread's; the oldest first
  std::int64_t accept_again_ns_ = 0;   // the thread's: without descriptors, not before
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace splid
