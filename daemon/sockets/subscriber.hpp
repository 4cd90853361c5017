#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/security/handshake_watch.hpp"

namespace splid::sockets {

// The client's end of a Publisher, for `splid listen` and `splid view`.
//
// Threads: one. Errors: the constructor throws Error(Fault::usage) for an endpoint that ZeroMQ
// cannot read. Connecting never fails: it is tried again until a daemon answers and, once a second,
// until the daemon lets this subscriber in. A daemon that gives no sign of life for 6 to 8 s is
// connected to again.
class Subscriber {
 public:
  struct Message {
    std::string topic;
    std::string json;
  };

  // topics: beginnings of topics. Where these are more pixels than a publisher takes from one
  // connection, messages of all pixels come, and the caller leaves out those that it did not ask
  // for, which come too where another asks for them. client: the subscriber's keys; absent: it has
  // none. most_waiting: how many messages may wait to be received, beyond which the newest are
  // lost; 0: no limit.
  Subscriber(const std::string& endpoint, const std::vector<std::string>& topics,
             const std::optional<security::CurveClient>& client = std::nullopt,
             int most_waiting = 0);
  ~Subscriber();
  Subscriber(const Subscriber&) = delete;
  Subscriber& operator=(const Subscriber&) = delete;

  // Hears a topic from now on, or no longer. Not one that it hears already, or does not hear.
  void subscribe(const std::string& topic);
  void unsubscribe(const std::string& topic);

  // The next message; absent when none came within the timeout. A message that has not two parts is
  // passed over.
  std::optional<Message> receive(std::chrono::milliseconds timeout);

  // Waits until a message can be received or the descriptor can be read, at most for `timeout`.
  void wait(int descriptor, std::chrono::milliseconds timeout);

  // The state of the connection.
  security::HandshakeWatch::State state();

 private:
  struct Socket;
  void try_again();

  const std::string endpoint_;
  std::unique_ptr<Socket> socket_;
  std::int64_t tried_ns_ = 0;
};

}  // namespace splid::sockets
