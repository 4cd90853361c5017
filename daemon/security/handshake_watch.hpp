#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "daemon/base/clock.hpp"
#include "daemon/security/curve_socket.hpp"

namespace zmq {
class context_t;
class socket_t;
}  // namespace zmq

namespace splid::security {

// The events of a socket's connections, such as handshakes, as libzmq reports them.
//
// Threads: made and destroyed on the socket's thread. next() may be called from another thread, but
// from one thread at a time, with a memory fence between two of them. libzmq keeps 2,000 events
// that were not taken; after that its own thread waits.
class SocketMonitor {
 public:
  struct Event {
    int kind = 0;             // ZMQ_EVENT_...
    std::uint32_t value = 0;  // depends on the kind
    std::string endpoint;     // of the socket, not of the peer
  };

  // socket: made in `context`. kinds: sum of the ZMQ_EVENT_... to report.
  // Errors: zmq::error_t.
  SocketMonitor(zmq::context_t& context, zmq::socket_t& socket, int kinds);
  // To be destroyed before the socket is closed.
  ~SocketMonitor();
  SocketMonitor(const SocketMonitor&) = delete;
  SocketMonitor& operator=(const SocketMonitor&) = delete;

  // The oldest event not yet taken; absent where there is none at present.
  std::optional<Event> next();

 private:
  zmq::socket_t& socket_;
  std::unique_ptr<zmq::socket_t> events_;
};

// Finds out why a client hears nothing. ZeroMQ itself does not tell: after a refusal it silently
// tries again.
//
// Threads: the socket's, for all calls.
class HandshakeWatch {
 public:
  enum class State {
    pending,          // not connected, for less than `patience_ns`
    unanswered,       // not connected for `patience_ns` or longer
    connected,        // the handshake is done
    refused,          // the server checked the key and does not let it in
    broken_off,       // the server ends each handshake without giving a reason
    other_mechanism,  // only one of the two ends has keys
    other_protocol,   // no ZeroMQ socket answers, or not the server whose key was given
  };
  // A daemon that is just starting has bound its socket within this time.
  static constexpr std::int64_t patience_ns = 3'000'000'000;

  // To be made before the socket connects.
  HandshakeWatch(zmq::context_t& context, zmq::socket_t& socket, const Clock& clock);

  // The state at present. A failure stays until a handshake is done.
  State state();

 private:
  void take(const SocketMonitor::Event& event);

  SocketMonitor monitor_;
  const Clock& clock_;
  State state_ = State::pending;
  bool broken_off_ = false;  // a handshake was broken off since the state became pending
  std::int64_t since_ns_;    // when the state became pending
};

// What a state means and what to do about it, in a sentence about `endpoint`. client: null where
// the client has no keys.
std::string in_words(HandshakeWatch::State state, const std::string& endpoint,
                     const CurveClient* client);

}  // namespace splid::security
