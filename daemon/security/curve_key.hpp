#pragma once

#include <span>
#include <string>
#include <string_view>

namespace splid::security {

// CURVE keys (RFC 26/ZMTP-CURVE) as text: the 32 bytes of a key are 40 characters of Z85 (RFC
// 32/Z85).

inline constexpr std::size_t curve_key_bytes = 32;
inline constexpr std::size_t curve_key_characters = 40;

struct CurveKeyPair {
  std::string public_key;
  std::string secret_key;
};

// Whether the text is 40 of Z85's 85 characters that stand for 32 bytes.
bool is_curve_key(std::string_view text);

std::string curve_key_text(std::span<const std::byte, curve_key_bytes> key);

// The beginning of a public key, enough for a person to tell keys apart.
std::string key_beginning(std::string_view public_key);

// Errors of both functions: Error(Fault::device) where this machine's libzmq has no CURVE.
CurveKeyPair make_curve_keys();
std::string public_key_of(const std::string& secret_key);

}  // namespace splid::security
