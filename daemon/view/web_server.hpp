#pragma once

#include <chrono>
#include <cstdint>
#include <list>
#include <memory>
#include <string>
#include <string_view>

#include "daemon/base/clock.hpp"
#include "daemon/base/file_descriptor.hpp"
#include "daemon/view/live_view.hpp"

struct MHD_Connection;
struct MHD_Daemon;
struct MHD_Response;

namespace splid::view {

// Serves the live page over HTTP (libmicrohttpd) and, to each viewer, what the page shows as
// server-sent events. It only reads: no request changes anything but what its viewer sees.
//
// A request is refused, and counted, where its Host is not this machine (403), its Origin another
// page's (403), its method neither GET nor HEAD (405), its path unknown (404), its head not what
// libmicrohttpd took it for (400), or where there are too many viewers (503) or connections (closed
// at once), of all peers or of one: a peer is an address, as to a gate (sockets::peer_of), this
// machine's too. libmicrohttpd itself refuses what is no HTTP or has headers of more than some 16
// KiB.
//
// A request has 10 s until it is whole, and an answer 20 s until it is taken; then the connection
// is closed. A viewer that reads too slowly is sent less often, and gets the newest then
// (LiveView::news); one that reads nothing for 15 s is let go.
//
// Threads: one calls everything. Errors: the constructor throws Error(Fault::usage) for an address
// that is malformed, and Error(Fault::device) where the port cannot be had.
class WebServer {
 public:
  static constexpr unsigned most_connections = 256;
  static constexpr std::size_t most_viewers = 64;
  // Of one peer.
  static constexpr std::size_t most_connections_a_peer = 64;
  static constexpr std::size_t most_viewers_a_peer = 16;
  static constexpr std::int64_t request_ns = 10'000'000'000;
  static constexpr std::int64_t answer_ns = 20'000'000'000;
  // Viewers get news at most so often, ten times a second: the page draws no more.
  static constexpr std::int64_t between_news_ns = 100'000'000;

  // address: HOST:PORT as ListeningSocket takes it. view and clock outlive this.
  WebServer(const std::string& address, LiveView& view, const Clock& clock);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  // Readable when run() has something to do.
  [[nodiscard]] int descriptor() const { return descriptor_; }
  // After so long run() is to be called, whatever the descriptor says.
  [[nodiscard]] std::chrono::milliseconds patience() const;
  // Reads and writes as far as that goes without waiting.
  void run();

  // The address of the page: http://127.0.0.1:9874/
  [[nodiscard]] std::string url() const;
  // Whether any viewer looks at the pictures of the photons.
  [[nodiscard]] bool fold_is_wanted() const;
  [[nodiscard]] LiveView::Web counts() const { return {viewers_.size(), refused_}; }

 private:
  struct Viewer;
  struct Connection;
  struct Callbacks;  // what libmicrohttpd calls
  void connected(MHD_Connection* connection, void** context);
  void disconnected(const void* context);
  void close_late() const;
  int answer(MHD_Connection* connection, std::string_view path, std::string_view method);
  int refuse(MHD_Connection* connection, unsigned code, const std::string& why);
  int serve_events(MHD_Connection* connection);
  int serve_frames(MHD_Connection* connection);
  [[nodiscard]] bool is_due(const Viewer& viewer) const;

  LiveView& view_;
  const Clock& clock_;
  std::string place_;  // HOST:PORT as bound
  std::string machine_name_;
  std::list<std::unique_ptr<Viewer>> viewers_;
  std::uint64_t refused_ = 0;
  std::list<std::unique_ptr<Connection>> connections_;
  MHD_Daemon* daemon_ = nullptr;
  int descriptor_ = -1;
};

}  // namespace splid::view
