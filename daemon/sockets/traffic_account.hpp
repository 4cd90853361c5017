#pragma once

#include <algorithm>
#include <cstdint>

#include "daemon/sockets/gate_limits.hpp"

namespace splid::sockets {

// The outstanding traffic of all connections of a peer, and how many connections it has.
struct PeerUse {
  Allowance spent;
  std::size_t connections = 0;
};

// Keeps account of one connection's outstanding traffic: what the peer has sent, less what the
// frames sent to the peer take off (GateLimits::back_for_short, back_for_long).
//
// Threads: the gate's. `peer` outlives this.
class TrafficAccount {
 public:
  TrafficAccount(const GateLimits& limits, PeerUse& peer) : limits_(&limits), peer_(&peer) {
    ++peer_->connections;
  }
  ~TrafficAccount() {
    add({-spent_.frames, -spent_.bytes});
    --peer_->connections;
  }
  TrafficAccount(const TrafficAccount&) = delete;
  TrafficAccount& operator=(const TrafficAccount&) = delete;

  void charge(std::uint64_t frame_bytes) { add({1, static_cast<std::int64_t>(frame_bytes)}); }
  void give_back(std::uint64_t body_bytes) {
    const Allowance& back =
        body_bytes <= longest_short_body ? limits_->back_for_short : limits_->back_for_long;
    add({-std::min(back.frames, spent_.frames), -std::min(back.bytes, spent_.bytes)});
  }
  [[nodiscard]] bool is_overdrawn() const {
    return exceeds(spent_, limits_->connection) || exceeds(peer_->spent, limits_->peer);
  }

 private:
  static bool exceeds(const Allowance& spent, const Allowance& limit) {
    return spent.frames > limit.frames || spent.bytes > limit.bytes;
  }
  void add(const Allowance& more) {
    spent_.frames += more.frames;
    spent_.bytes += more.bytes;
    peer_->spent.frames += more.frames;
    peer_->spent.bytes += more.bytes;
  }

  const GateLimits* limits_;
  PeerUse* peer_;
  Allowance spent_;  // outstanding, never below 0
};

}  // namespace splid::sockets
