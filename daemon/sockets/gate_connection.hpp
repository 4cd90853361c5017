#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/base/file_descriptor.hpp"
#include "daemon/sockets/peer.hpp"
#include "daemon/sockets/relay.hpp"
#include "daemon/sockets/traffic_account.hpp"
#include "daemon/sockets/zmtp_framing.hpp"

namespace splid {

// A peer's connection and the one to the ZeroMQ socket that was made for it, with what passes
// between them: all of it, as it is, until it is too much.
//
// Threads: the gate's.
class GateConnection {
 public:
  // What a peer did that its connection ends of.
  enum class Offence { none, other_protocol, long_frame, flood };

  // curve: whether the socket speaks it.
  GateConnection(FileDescriptor outside, FileDescriptor inside, Peer peer, const GateLimits& limits,
                 PeerUse& use, bool curve, std::int64_t now_ns);
  GateConnection(const GateConnection&) = delete;
  GateConnection& operator=(const GateConnection&) = delete;

  [[nodiscard]] int outside() const { return outside_.get(); }
  [[nodiscard]] int inside() const { return inside_.get(); }
  [[nodiscard]] const Peer& peer() const { return peer_; }
  [[nodiscard]] std::int64_t begin_ns() const { return begin_ns_; }
  [[nodiscard]] Offence offence() const { return offence_; }

  Relay up;                          // from the peer
  Relay down;                        // to the peer
  std::int64_t ending_since_ns = 0;  // the socket behind has ended, the peer takes its time; 0: no

  // Held with what asks for a judgement on its key, until let_judge().
  [[nodiscard]] bool waits_for_judgement() const { return up.is_held(); }
  void let_judge();
  // Answered, one way or the other.
  [[nodiscard]] bool is_judged() const { return frames_down_ >= handshake_frames_; }
  // Told that its key is refused.
  [[nodiscard]] bool is_turned_away() const { return is_turned_away_; }
  // Has done its part of the handshake and has been let in.
  [[nodiscard]] bool is_admitted() const;
  // Has said anything at all.
  [[nodiscard]] bool has_spoken() const { return has_spoken_; }
  // The security that it asks for, where that is known and not the socket's; else empty.
  [[nodiscard]] std::string other_mechanism() const;

 private:
  bool inspect_up(std::span<const std::byte> bytes);
  bool inspect_down(std::span<const std::byte> bytes);
  [[nodiscard]] Offence offence_of(std::span<const std::uint64_t> bodies) const;

  FileDescriptor outside_;
  FileDescriptor inside_;
  Peer peer_;
  const GateLimits& limits_;
  TrafficAccount account_;
  const bool curve_;
  const std::size_t handshake_frames_;  // each way
  const std::int64_t begin_ns_;
  ZmtpFraming framing_up_;
  ZmtpFraming framing_down_;
  std::vector<std::uint64_t> bodies_;  // of one piece
  std::size_t frames_up_ = 0;
  std::size_t frames_down_ = 0;
  Offence offence_ = Offence::none;
  bool may_ask_ = false;
  bool is_turned_away_ = false;
  bool has_spoken_ = false;
};

}  // namespace splid
