#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "daemon/service/control/control_message.hpp"

namespace splid::security {
class Authenticator;
class Refusals;
}  // namespace splid::security

namespace splid::control {

// The functions that carry out requests. Both may throw Error, which becomes the reply.
struct Handlers {
  // Answers a status request, at once, on the thread that serves all clients. doing: the name of
  // the action that is running; empty: none.
  std::function<Reply(const std::string& doing)> status;
  // Carries out any other request, one at a time, on a thread of its own. It may take as long as it
  // needs, but has to end within about 100 ms of a stop request.
  std::function<Reply(const Request&, const std::stop_token&)> perform;
};

// The server for control requests: a ZeroMQ ROUTER socket, on a Unix socket with mode 0600 or on
// TCP with CURVE. A request is one JSON part, perhaps after an empty part, and is answered by one
// JSON part (docs/reference/control.md). While an action is running, another action is refused as
// busy, and status requests are answered.
//
// Requests never slow down frames: the server has threads of its own and, unless it is on TCP, a
// ZeroMQ context of its own. It takes requests of at most 4 KiB, and at most 100 of them in 10 ms.
// A client that does not read loses replies.
//
// Threads: made and destroyed on one thread. The server's own threads are `control`, which owns the
// socket, `gate`, and `control-work`, which carries out actions. Errors: the constructor's are
// UnixListener's; Error(Fault::device) where a port cannot be bound. Timeouts: the destructor asks
// the running action to stop, waits for it, and gives its reply up to 300 ms to go out.
class Server {
 public:
  // endpoint: ipc:///PATH, or tcp:// with an authenticator. authenticator: checks keys against the
  // allow-list of control_domain; null for ipc; outlives this. refusals: told of peers that are
  // disconnected; outlives this.
  Server(const std::string& endpoint, Handlers handlers, security::Authenticator* authenticator,
         security::Refusals& refusals);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // The endpoint as bound, with the port that the system chose for *.
  [[nodiscard]] const std::string& endpoint() const;

 private:
  struct Service;
  std::unique_ptr<Service> service_;
};

}  // namespace splid::control
