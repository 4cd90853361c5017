#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "daemon/base/clock.hpp"
#include "daemon/security/refusals.hpp"
#include "daemon/sockets/gate_connection.hpp"
#include "daemon/sockets/gate_limits.hpp"
#include "daemon/sockets/listening_socket.hpp"
#include "daemon/sockets/private_door.hpp"

namespace splid::sockets {

// The room daemon/sockets guards the daemon's endpoints. A Gate accepts the connections of a
// listening socket, and each connection passes through a GateConnection to the ZeroMQ socket behind
// the gate. Read this header first, then gate_connection.hpp.

// Stands between an endpoint and the ZeroMQ socket behind it, and limits how much each peer may
// send (gate_limits.hpp), since libzmq takes everything that is sent to it into memory without a
// bound. Bytes pass unchanged, so the CURVE encryption stays between the peer and the socket. A
// peer that sends more than its limit is disconnected at once, counted, and reported with its
// address.
//
// Threads: one of its own; all calls from any thread. Errors: none. Timeouts: the destructor gives
// peers up to `drain` to take what is queued for them.
class Gate {
 public:
  static constexpr std::chrono::milliseconds drain{300};

  struct Behind {
    const PrivateDoor& door;  // outlives the gate; the socket behind it need not
    GateLimits limits;
    bool curve = false;  // whether the socket behind speaks CURVE
  };

  // refusals, clock: outlive this.
  Gate(ListeningSocket listener, const Behind& behind, security::Refusals& refusals,
       const Clock& clock);
  ~Gate();
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;

  [[nodiscard]] const std::string& endpoint() const { return listener_.endpoint(); }

  // The peer whose key the socket behind is checking at present; empty: none. The gate lets only
  // one peer at a time have its key checked.
  [[nodiscard]] std::string judged_peer() const;

 private:
  struct KnownPeer {
    PeerUse use;
    double new_connections = 0;  // how many more it may make at present
    std::int64_t since_ns = 0;
  };
  using Connections = std::map<std::uint64_t, std::unique_ptr<GateConnection>>;

  void run();
  [[nodiscard]] bool is_done(std::int64_t end_ns) const;
  [[nodiscard]] int patience_ms() const;
  void add_to_epoll(int descriptor, std::uint64_t token, std::uint32_t events) const;
  void take_event(std::uint64_t token);
  void serve_again();
  void accept_some();
  void pause_accepting();
  void admit(FileDescriptor outside);
  bool has_room_for(const Peer& peer, KnownPeer& known);
  bool make_room(const std::string* group);
  void serve(std::uint64_t id);
  bool pump(std::uint64_t id, GateConnection& connection);
  void end(std::uint64_t id);
  void say_why(const GateConnection& connection, Relay::Result up, Relay::Result down);
  void charge_flood(const Peer& peer);
  void say_handshake(const GateConnection& connection, bool peer_left);
  void refuse(security::Refusal reason, const Peer& peer, const std::string& why);
  void judge_next();
  void end_judgement();
  void look_after();

  ListeningSocket listener_;
  const PrivateDoor& door_;
  const GateLimits limits_;
  const bool curve_;
  security::Refusals& refusals_;
  const Clock& clock_;
  const std::string name_;
  FileDescriptor epoll_;
  FileDescriptor wake_;

  // The members below belong to the gate's thread, up to mutex_.
  std::map<std::string, KnownPeer> peers_;  // by group
  Connections connections_;
  std::uint64_t next_id_ = 1;
  std::deque<std::uint64_t> again_;  // connections that have more to pass on
  std::deque<std::uint64_t> to_be_judged_;
  std::uint64_t judged_ = 0;  // the connection whose key is being checked; 0: none
  std::int64_t judged_since_ns_ = 0;
  std::int64_t accept_again_ns_ = 0;  // when to accept connections again; 0: it accepts them now
  std::int64_t look_after_ns_ = 0;
  std::vector<std::byte> scratch_;

  mutable std::mutex mutex_;
  std::string judged_peer_;  // guarded by mutex_
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace splid::sockets
