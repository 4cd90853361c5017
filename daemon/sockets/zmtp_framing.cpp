#include "daemon/sockets/zmtp_framing.hpp"

#include <algorithm>

namespace splid::sockets {
namespace {

constexpr std::byte signature_begin{0xff};
constexpr std::byte signature_end{0x7f};
constexpr std::size_t signature_end_at = 9;
constexpr std::size_t major_at = 10;
constexpr std::byte least_major{3};
constexpr std::size_t mechanism_at = 12;
constexpr std::size_t mechanism_bytes = 20;

constexpr std::byte long_flag{2};
constexpr std::byte known_flags{7};  // more, long, command

// Whether the first bytes received can be the beginning of a greeting.
bool may_be_greeting(std::span<const std::byte> begun) {
  if (begun[0] != signature_begin) return false;
  if (begun.size() > signature_end_at && begun[signature_end_at] != signature_end) return false;
  return begun.size() <= major_at || begun[major_at] >= least_major;
}

std::string mechanism_of(std::span<const std::byte> greeting) {
  std::string name;
  for (const std::byte byte : greeting.subspan(mechanism_at, mechanism_bytes)) {
    const char letter = static_cast<char>(byte);
    if (letter < ' ' || letter > '~') break;
    name += letter;
  }
  return name.empty() ? "nothing" : name;
}

}  // namespace

bool ZmtpFraming::take(std::span<const std::byte> bytes, std::vector<std::uint64_t>& bodies) {
  while (is_zmtp_ && !bytes.empty()) {
    const auto inside = static_cast<std::size_t>(std::min<std::uint64_t>(body_left_, bytes.size()));
    body_left_ -= inside;
    bytes = bytes.subspan(inside);
    if (bytes.empty()) break;
    is_zmtp_ = greeted_ ? take_header(bytes, bodies) : take_greeting(bytes);
  }
  return is_zmtp_;
}

bool ZmtpFraming::take_greeting(std::span<const std::byte>& bytes) {
  const std::size_t taken = std::min(bytes.size(), greeting_bytes - begun_bytes_);
  std::copy_n(bytes.begin(), taken, begun_.begin() + static_cast<std::ptrdiff_t>(begun_bytes_));
  begun_bytes_ += taken;
  bytes = bytes.subspan(taken);
  if (!may_be_greeting(std::span(begun_).first(begun_bytes_))) return false;
  if (begun_bytes_ == greeting_bytes) {
    mechanism_ = mechanism_of(begun_);
    begun_bytes_ = 0;
    greeted_ = true;
  }
  return true;
}

bool ZmtpFraming::take_header(std::span<const std::byte>& bytes,
                              std::vector<std::uint64_t>& bodies) {
  begun_[begun_bytes_++] = bytes.front();
  bytes = bytes.subspan(1);
  const std::byte flags = begun_[0];
  if ((flags & ~known_flags) != std::byte{0}) return false;
  const std::size_t header_bytes = (flags & long_flag) == std::byte{0} ? 2 : largest_header_bytes;
  if (begun_bytes_ < header_bytes) return true;
  for (std::size_t i = 1; i < header_bytes; ++i) {
    body_left_ = body_left_ << 8 | std::to_integer<std::uint64_t>(begun_[i]);
  }
  begun_bytes_ = 0;
  bodies.push_back(body_left_);
  return true;
}

}  // namespace splid::sockets
