#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "daemon/base/clock.hpp"
#include "daemon/security/curve_socket.hpp"
#include "daemon/security/socket_monitor.hpp"

namespace splid {

// Why a client hears nothing, since to ZeroMQ a refusal is one more reason to try again in silence.
//
// Threads: the socket's, made and used there.
class HandshakeWatch {
 public:
  enum class State {
    pending,          // no connection since less than `patience_ns`
    unanswered,       // nor for longer
    connected,        // the handshake is done
    refused,          // the server knows the key and does not let it in
    broken_off,       // the server ends each handshake without a word
    other_mechanism,  // one has keys and the other has not
    other_protocol,   // it is no ZeroMQ socket, or not the server whose key was given
  };
  // A daemon that starts has bound its socket by then.
  static constexpr std::int64_t patience_ns = 3'000'000'000;

  // Before the socket connects.
  HandshakeWatch(zmq::context_t& context, zmq::socket_t& socket, const Clock& clock);

  // As of now. A failure stays until a handshake is done.
  State state();

 private:
  void take(const SocketMonitor::Event& event);

  SocketMonitor monitor_;
  const Clock& clock_;
  State state_ = State::pending;
  bool broken_off_ = false;  // while pending
  std::int64_t since_ns_;    // of pending
};

// What that means and what to do, in a sentence about `endpoint`. client: null where it has no
// keys.
std::string in_words(HandshakeWatch::State state, const std::string& endpoint,
                     const CurveClient* client);

}  // namespace splid
