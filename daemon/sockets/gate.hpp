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

namespace splid {

// Stands between an endpoint and the ZeroMQ socket behind it, and lets each peer through with as
// much as it has to say and no more, since libzmq takes what it is sent into memory without a
// bound. Bytes pass as they are, so CURVE is the two ends' own. Who sends more is let go at once,
// counted and named with its address.
//
// Threads: one of its own; all calls from any. Errors: none. Timeouts: the destructor lets what is
// queued for peers out for up to `drain`.
class Gate {
 public:
  static constexpr std::chrono::milliseconds drain{300};

  struct Behind {
    const PrivateDoor& door;  // outlives this, as its socket need not
    GateLimits limits;
    bool curve = false;  // whether the socket speaks it
  };

  // refusals, clock: outlive this.
  Gate(ListeningSocket listener, const Behind& behind, Refusals& refusals, const Clock& clock);
  ~Gate();
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;

  [[nodiscard]] const std::string& endpoint() const { return listener_.endpoint(); }

  // Whose key the socket is being asked about, which is one at a time; empty: nobody's.
  [[nodiscard]] std::string judged_peer() const;

 private:
  struct KnownPeer {
    PeerUse use;
    double new_connections = 0;  // that it may make now
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
  void refuse(Refusal reason, const Peer& peer, const std::string& why);
  void judge_next();
  void end_judgement();
  void look_after();

  ListeningSocket listener_;
  const PrivateDoor& door_;
  const GateLimits limits_;
  const bool curve_;
  Refusals& refusals_;
  const Clock& clock_;
  const std::string name_;
  FileDescriptor epoll_;
  FileDescriptor wake_;

  // The thread's.
  std::map<std::string, KnownPeer> peers_;  // by group
  Connections connections_;
  std::uint64_t next_id_ = 1;
  std::deque<std::uint64_t> again_;  // have more to pass on
  std::deque<std::uint64_t> to_be_judged_;
  std::uint64_t judged_ = 0;  // 0: none
  std::int64_t judged_since_ns_ = 0;
  std::int64_t accept_again_ns_ = 0;  // 0: it does; taken up
  std::int64_t look_after_ns_ = 0;
  std::vector<std::byte> scratch_;

  mutable std::mutex mutex_;
  std::string judged_peer_;  // guarded by mutex_
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace splid
