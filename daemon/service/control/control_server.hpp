#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "daemon/service/control/control_message.hpp"

namespace splid {

class Authenticator;
class Refusals;

// Who does what is asked. Both may throw Error, which becomes the reply.
struct ControlHandlers {
  // At once, on the thread that serves all clients. doing: the action that runs; empty: none.
  std::function<ControlReply(const std::string& doing)> status;
  // Anything but status, one at a time, on a thread of its own; takes as long as it takes, but ends
  // within 100 ms or so of a stop request.
  std::function<ControlReply(const ControlRequest&, const std::stop_token&)> perform;
};

// The ZeroMQ socket that control requests come to: ROUTER, on a Unix socket of 0600, or on TCP with
// CURVE; one JSON part a request (after an empty one, or without), each answered by one
// (docs/reference/control.md). While an action runs another is refused as busy, and status goes on.
//
// Whatever comes in costs frames nothing: own threads, without TCP an own ZeroMQ context, requests
// of at most 4 KiB, 100 of them each 10 ms; a client that does not read loses replies.
//
// Threads: made and destroyed on one; has `control`, which owns the socket, `gate`, and
// `control-work`, which performs. Errors: the constructor's are UnixListener's;
// Error(Fault::device) where a port cannot be bound. Timeouts: the destructor waits for the action
// that runs, which it asks to stop, and up to 300 ms for its reply to go out.
class ControlServer {
 public:
  // endpoint: ipc:///PATH, or tcp:// with an authenticator, which outlives this and asks the list
  // of control_domain; null: ipc. refusals: hears who is let go; outlives this.
  ControlServer(const std::string& endpoint, ControlHandlers handlers, Authenticator* authenticator,
                Refusals& refusals);
  ~ControlServer();
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;

  // As bound: a wildcard port is resolved.
  [[nodiscard]] const std::string& endpoint() const;

 private:
  struct Service;
  std::unique_ptr<Service> service_;
};

}  // namespace splid
