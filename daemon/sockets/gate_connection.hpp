#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/base/file_descriptor.hpp"
#include "daemon/sockets/peer.hpp"
#include "daemon/sockets/relay.hpp"
#include "daemon/sockets/traffic_account.hpp"
#include "daemon/sockets/zmtp_framing.hpp"

namespace splid::sockets {

// The connection of one peer, together with the connection to the ZeroMQ socket that the gate made
// for that peer. Every byte passes between them unchanged, until the peer sends too much.
//
// Threads: the gate's.
class GateConnection {
 public:
  // Why a peer's connection has to end.
  enum class Offence { none, other_protocol, long_frame, flood };

  // curve: whether the socket behind speaks CURVE.
  GateConnection(FileDescriptor outside, FileDescriptor inside, Peer peer, const GateLimits& limits,
                 PeerUse& use, bool curve, std::int64_t now_ns);
  GateConnection(const GateConnection&) = delete;
  GateConnection& operator=(const GateConnection&) = delete;

  [[nodiscard]] int outside() const { return outside_.get(); }
  [[nodiscard]] int inside() const { return inside_.get(); }
  [[nodiscard]] const Peer& peer() const { return peer_; }
  [[nodiscard]] std::int64_t begin_ns() const { return begin_ns_; }
  [[nodiscard]] Offence offence() const { return offence_; }

  Relay up;                          // from the peer to the socket behind
  Relay down;                        // from the socket behind to the peer
  std::int64_t ending_since_ns = 0;  // when the socket behind closed its end; 0: it has not

  // The bytes that ask for a check of the peer's key are held back until let_judge().
  [[nodiscard]] bool waits_for_judgement() const { return up.is_held(); }
  void let_judge();
  // The check of the key is done, whatever its result.
  [[nodiscard]] bool is_judged() const { return frames_down_ >= handshake_frames_; }
  // The peer was told that its key is refused.
  [[nodiscard]] bool is_turned_away() const { return is_turned_away_; }
  // The handshake is done and the peer was let in.
  [[nodiscard]] bool is_admitted() const;
  // The peer has sent at least one byte.
  [[nodiscard]] bool has_spoken() const { return has_spoken_; }
  // The security mechanism that the peer asks for, if that is known and is not the socket's;
  // otherwise empty.
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
  const std::size_t handshake_frames_;  // in each direction
  const std::int64_t begin_ns_;
  ZmtpFraming framing_up_;
  ZmtpFraming framing_down_;
  std::vector<std::uint64_t> bodies_;  // scratch: lengths of the frames in one piece of bytes
  std::size_t frames_up_ = 0;
  std::size_t frames_down_ = 0;
  Offence offence_ = Offence::none;
  bool may_ask_ = false;
  bool is_turned_away_ = false;
  bool has_spoken_ = false;
};

}  // namespace splid::sockets
