#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace splid {

// Where the frames of one direction of a ZMTP 3 connection begin and how long they are (RFC 23,
// 37/ZMTP). What they hold is not looked at: with CURVE it cannot be.
class ZmtpFraming {
 public:
  // Adds the length of each frame's body, in bytes, as soon as its header is there. False where
  // this is no ZMTP 3: then, and ever after.
  bool take(std::span<const std::byte> bytes, std::vector<std::uint64_t>& bodies);

  // The security that the greeting asks for, "NULL" or "CURVE"; empty before its end.
  [[nodiscard]] const std::string& mechanism() const { return mechanism_; }

  static constexpr std::size_t greeting_bytes = 64;
  static constexpr std::size_t largest_header_bytes = 9;

 private:
  bool take_greeting(std::span<const std::byte>& bytes);
  bool take_header(std::span<const std::byte>& bytes, std::vector<std::uint64_t>& bodies);

  std::array<std::byte, greeting_bytes> begun_{};  // the greeting, then each header
  std::size_t begun_bytes_ = 0;
  std::uint64_t body_left_ = 0;
  std::string mechanism_;
  bool greeted_ = false;
  bool is_zmtp_ = true;
};

}  // namespace splid
