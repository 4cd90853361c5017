#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "daemon/security/curve_socket.hpp"
#include "daemon/service/control/control_message.hpp"

namespace splid {

// The other end of a ControlServer, for `ctl`.
//
// Threads: one. Errors: the constructor throws Error(Fault::device) where no socket is there or it
// is not this user's; ask() likewise where nobody answers. Timeouts: ask() gives up after 2 s
// without a sign of the daemon, which answers status whatever else it does.
class ControlClient {
 public:
  // Hears what the daemon says of itself while the answer is awaited, once a second.
  using Progress = std::function<void(const ControlReply& status)>;

  // endpoint: ipc:///PATH, or tcp:// with the keys of both sides.
  ControlClient(std::string endpoint, std::optional<CurveClient> keys);
  ~ControlClient();
  ControlClient(const ControlClient&) = delete;
  ControlClient& operator=(const ControlClient&) = delete;

  // The reply, also a refusal. Errors: Error(Fault::usage) after a stop request: what was asked for
  // goes on; Error(Fault::data) where what answers is no splid.
  ControlReply ask(const ControlRequest& request, const Progress& progress,
                   const std::stop_token& stop);

 private:
  struct Socket;
  void send(const ControlRequest& request);
  [[noreturn]] void fail(const std::string& why) const;
  [[noreturn]] void fail_silent() const;

  std::string endpoint_;
  std::optional<CurveClient> keys_;
  std::unique_ptr<Socket> socket_;
};

}  // namespace splid
