#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "daemon/security/curve_socket.hpp"
#include "daemon/service/control/control_message.hpp"

namespace splid::control {

// The client's end of a control::Server, for `splid ctl`.
//
// Threads: one. Errors: the constructor throws Error(Fault::device) where there is no socket or
// this user may not use it; ask() throws Error(Fault::device) where no daemon answers. Timeouts:
// ask() gives up after 2 s in which it does not get in, or after 10 s without a sign of a daemon
// that let it in: the daemon answers status requests at any time.
class Client {
 public:
  // Called once a second, while the reply is awaited, with the daemon's status.
  using Progress = std::function<void(const Reply& status)>;

  // endpoint: ipc:///PATH, or tcp:// with the keys of both sides.
  Client(std::string endpoint, std::optional<security::CurveClient> keys);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  // Returns the reply, which may be a refusal. Errors: Error(Fault::usage) after a stop request,
  // while the daemon goes on with what it was asked for; Error(Fault::data) where the program that
  // answers is not splid.
  Reply ask(const Request& request, const Progress& progress, const std::stop_token& stop);

 private:
  struct Socket;
  void send(const Request& request);
  std::chrono::milliseconds patience_at_present() const;
  [[noreturn]] void fail(const std::string& why) const;
  [[noreturn]] void fail_silent() const;

  std::string endpoint_;
  std::optional<security::CurveClient> keys_;
  std::unique_ptr<Socket> socket_;
};

}  // namespace splid::control
