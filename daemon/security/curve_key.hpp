#pragma once

#include <span>
#include <string>
#include <string_view>

namespace splid {

// CURVE keys (RFC 26/ZMTP-CURVE) as text: 32 bytes in Z85 (RFC 32/Z85), which are 40 characters.

inline constexpr std::size_t curve_key_bytes = 32;
inline constexpr std::size_t curve_key_characters = 40;

struct CurveKeyPair {
  std::string public_key;
  std::string secret_key;
};

// Of Z85's 85 characters, 40 that stand for 32 bytes.
bool is_curve_key(std::string_view text);

std::string curve_key_text(std::span<const std::byte, curve_key_bytes> key);

// As much of a public key as tells keys apart for a person.
std::string key_beginning(std::string_view public_key);

// Errors of these: Error(Fault::device) where the machine's libzmq has no CURVE.
CurveKeyPair make_curve_keys();
std::string public_key_of(const std::string& secret_key);

}  // namespace splid
