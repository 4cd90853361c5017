#include "daemon/sockets/gate_connection.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace splid::sockets {
namespace {

// The bytes of a peer's greeting after which the socket behind sends the rest of its own greeting.
// Where libzmq reads a whole greeting with another mechanism at once, it ends the connection before
// it has sent its own mechanism. So the rest of the peer's greeting is passed on only after the
// socket's greeting has come, and the peer learns that the mechanisms differ.
constexpr std::size_t version_bytes = 12;

// Frames of the handshake in each direction. Without CURVE: READY. With CURVE: HELLO and INITIATE
// from the peer, WELCOME and then READY or ERROR from the socket.
constexpr std::size_t plain_handshake_frames = 1;
constexpr std::size_t curve_handshake_frames = 2;

// Tells ERROR from READY by its length: ERROR carries a reason of three digits, and the encrypted
// READY is longer.
constexpr std::uint64_t longest_error_body = 24;

}  // namespace

GateConnection::GateConnection(FileDescriptor outside, FileDescriptor inside, Peer peer,
                               const GateLimits& limits, PeerUse& use, bool curve,
                               std::int64_t now_ns)
    : up(outside.get(), inside.get(), [this](auto bytes) { return inspect_up(bytes); }),
      down(inside.get(), outside.get(), [this](auto bytes) { return inspect_down(bytes); }),
      outside_(std::move(outside)),
      inside_(std::move(inside)),
      peer_(std::move(peer)),
      limits_(limits),
      account_(limits, use),
      curve_(curve),
      handshake_frames_(curve ? curve_handshake_frames : plain_handshake_frames),
      begin_ns_(now_ns) {
  up.allow(version_bytes);
}

void GateConnection::let_judge() {
  may_ask_ = true;
  up.hold(false);
}

bool GateConnection::is_admitted() const {
  return frames_up_ >= handshake_frames_ && is_judged() && !is_turned_away_;
}

std::string GateConnection::other_mechanism() const {
  const std::string& asked = framing_up_.mechanism();
  return asked.empty() || asked == (curve_ ? "CURVE" : "NULL") ? "" : asked;
}

bool GateConnection::inspect_up(std::span<const std::byte> bytes) {
  has_spoken_ = true;
  bodies_.clear();
  const bool is_zmtp = framing_up_.take(bytes, bodies_);
  for (const std::uint64_t body : bodies_) {
    account_.charge(std::min(body, limits_.frame_bytes + 1) + ZmtpFraming::largest_header_bytes);
  }
  frames_up_ += bodies_.size();
  offence_ = is_zmtp ? offence_of(bodies_) : Offence::other_protocol;
  // A peer that stops within this frame must not hold up the check of the others' keys.
  const std::size_t whole_frames = frames_up_ - (framing_up_.body_left() > 0 ? 1 : 0);
  if (curve_ && !may_ask_ && whole_frames >= handshake_frames_) up.hold(true);
  return offence_ == Offence::none;
}

GateConnection::Offence GateConnection::offence_of(std::span<const std::uint64_t> bodies) const {
  const bool is_long = std::any_of(bodies.begin(), bodies.end(), [this](std::uint64_t body) {
    return body > limits_.frame_bytes;
  });
  if (is_long) return Offence::long_frame;
  return account_.is_overdrawn() ? Offence::flood : Offence::none;
}

bool GateConnection::inspect_down(std::span<const std::byte> bytes) {
  bodies_.clear();
  (void)framing_down_.take(bytes, bodies_);
  if (!framing_down_.mechanism().empty()) up.allow(std::numeric_limits<std::size_t>::max());
  for (const std::uint64_t body : bodies_) {
    account_.give_back(body);
    ++frames_down_;
    if (curve_ && frames_down_ == handshake_frames_) is_turned_away_ = body <= longest_error_body;
  }
  return true;
}

}  // namespace splid::sockets
