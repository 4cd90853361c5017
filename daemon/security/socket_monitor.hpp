#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace zmq {
class context_t;
class socket_t;
}  // namespace zmq

namespace splid {

// What happens to a socket's connections below its messages, as libzmq tells it.
//
// Threads: made and ended on the socket's; next() on any one, with a fence between two.
// libzmq keeps 2,000 events that were not taken, then its own thread waits until some were.
class SocketMonitor {
 public:
  struct Event {
    int kind = 0;             // ZMQ_EVENT_...
    std::uint32_t value = 0;  // depends on the kind
    std::string endpoint;     // the socket's, not the peer's
  };

  // socket: of that context. kinds: ZMQ_EVENT_..., those of interest added up.
  // Errors: zmq::error_t.
  SocketMonitor(zmq::context_t& context, zmq::socket_t& socket, int kinds);
  // Before the socket is closed.
  ~SocketMonitor();
  SocketMonitor(const SocketMonitor&) = delete;
  SocketMonitor& operator=(const SocketMonitor&) = delete;

  // Absent where there is none now.
  std::optional<Event> next();

 private:
  zmq::socket_t& socket_;
  std::unique_ptr<zmq::socket_t> events_;
};

}  // namespace splid
