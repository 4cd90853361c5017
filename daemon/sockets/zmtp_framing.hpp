#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace splid::sockets {

// Finds where the ZMTP frames in one direction of a connection begin and how long they are (RFC 23,
// RFC 37/ZMTP). It does not look into the frames, which with CURVE are encrypted.
class ZmtpFraming {
 public:
  // Takes the next bytes, and appends to `bodies` the length in bytes of each frame's body as soon
  // as the frame's header is complete. Returns false, from then on, where the bytes are not ZMTP 3.
  bool take(std::span<const std::byte> bytes, std::vector<std::uint64_t>& bodies);

  // How many bytes of the last frame's body have not come yet.
  [[nodiscard]] std::uint64_t body_left() const { return body_left_; }

  // The security mechanism in the greeting, "NULL" or "CURVE"; empty before the greeting is
  // complete.
  [[nodiscard]] const std::string& mechanism() const { return mechanism_; }

  static constexpr std::size_t greeting_bytes = 64;
  static constexpr std::size_t largest_header_bytes = 9;

 private:
  bool take_greeting(std::span<const std::byte>& bytes);
  bool take_header(std::span<const std::byte>& bytes, std::vector<std::uint64_t>& bodies);

  std::array<std::byte, greeting_bytes> begun_{};  // an incomplete greeting or frame header
  std::size_t begun_bytes_ = 0;
  std::uint64_t body_left_ = 0;
  std::string mechanism_;
  bool greeted_ = false;
  bool is_zmtp_ = true;
};

}  // namespace splid::sockets
