#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "daemon/security/handshake_watch.hpp"
#include "daemon/sockets/subscriber.hpp"
#include "daemon/view/live_view.hpp"
#include "daemon/view/web_server.hpp"

namespace splid::view {

// A sentence on who can read a page at this HOST:PORT, or port of this machine; empty where this
// machine alone can.
std::string who_can_read(const std::string& address);

// The live page at work: it subscribes to a daemon and serves what it hears to browsers.
//
// Threads: one at a time. run() waits for the daemon's messages and for browsers alike. Errors:
// the constructor throws as sockets::Subscriber's and WebServer's do; whether a daemon answers is
// no error.
class Viewing {
 public:
  using State = security::HandshakeWatch::State;
  // Hears how the connection to the daemon is, at first and when that changes, with a sentence on
  // it.
  using HearState = std::function<void(State, const std::string& words)>;

  // endpoint: the daemon's publish.endpoint. http: HOST:PORT of the page, or its port on 127.0.0.1.
  Viewing(std::string endpoint, const std::string& http,
          std::optional<security::CurveClient> client);

  // The address of the page.
  [[nodiscard]] std::string url() const { return server_.url(); }

  // Until `stop`.
  void run(const std::stop_token& stop, const HearState& hear);

 private:
  void take_messages();
  void look_at_connection(const HearState& hear);
  void ask_for_fold();
  void ask_for_pixels();

  std::string endpoint_;
  std::optional<security::CurveClient> client_;
  sockets::Subscriber subscriber_;
  LiveView view_;
  WebServer server_;
  std::optional<State> said_;
  bool hears_fold_ = false;
  std::vector<std::string> heard_pixels_;
};

}  // namespace splid::view
