#include "daemon/sockets/relay.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <utility>

namespace splid::sockets {
namespace {

// Pieces passed on before other connections have their turn.
constexpr int pieces_a_turn = 8;

constexpr std::size_t unlimited = std::numeric_limits<std::size_t>::max();

bool is_for_later(int error) { return error == EAGAIN || error == EWOULDBLOCK || error == EINTR; }

}  // namespace

Relay::Result Relay::pump(std::span<std::byte> scratch) {
  for (int i = 0; i < pieces_a_turn; ++i) {
    if (const Result result = flush(); result != Result::idle) return result;
    if (allowed_ == 0) return Result::full;
    const ssize_t got =
        ::recv(from_, scratch.data(), std::min(scratch.size(), allowed_), MSG_DONTWAIT);
    if (got < 0 && is_for_later(errno)) return Result::idle;
    if (got <= 0) return Result::ended;
    if (allowed_ != unlimited) allowed_ -= static_cast<std::size_t>(got);
    const std::span<const std::byte> piece = scratch.first(static_cast<std::size_t>(got));
    if (!inspect_(piece)) return Result::refused;
    if (held_) {
      pending_.assign(piece.begin(), piece.end());
      return Result::full;
    }
    if (const Result result = send(piece); result != Result::idle) return result;
  }
  return Result::more;
}

Relay::Result Relay::flush() {
  if (held_) return Result::full;
  if (pending_.empty()) return Result::idle;
  const std::vector<std::byte> bytes = std::exchange(pending_, {});
  return send(bytes);
}

// Sends bytes; those that the receiver does not take now become pending_.
Relay::Result Relay::send(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(to_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0 && is_for_later(errno)) {
      pending_.assign(bytes.begin(), bytes.end());
      return Result::full;
    }
    if (sent < 0) return Result::broken;
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return Result::idle;
}

}  // namespace splid::sockets
