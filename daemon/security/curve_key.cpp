#include "daemon/security/curve_key.hpp"

#include <zmq.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "protocol/error.hpp"

namespace splid::security {
namespace {

constexpr std::string_view z85_characters =
    "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.-:+=^!/*?&<>()[]{}@%$#";

constexpr std::size_t characters_a_group = 5;  // stand for four bytes

bool fits_four_bytes(std::string_view group) {
  std::uint64_t value = 0;
  for (const char character : group) {
    const std::size_t digit = z85_characters.find(character);
    if (digit == std::string_view::npos) return false;
    value = value * z85_characters.size() + digit;
  }
  return value <= 0xffff'ffff;
}

using KeyText = std::array<char, curve_key_characters + 1>;  // with its final NUL

[[noreturn]] void throw_no_curve() {
  throw Error(Fault::device,
              "this machine's libzmq has no CURVE; install one that was built with libsodium, as "
              "Debian's libzmq5 is");
}

}  // namespace

bool is_curve_key(std::string_view text) {
  if (text.size() != curve_key_characters) return false;
  for (; !text.empty(); text.remove_prefix(characters_a_group)) {
    if (!fits_four_bytes(text.substr(0, characters_a_group))) return false;
  }
  return true;
}

std::string curve_key_text(std::span<const std::byte, curve_key_bytes> key) {
  KeyText text{};
  zmq_z85_encode(text.data(), reinterpret_cast<const std::uint8_t*>(key.data()), key.size());
  return text.data();
}

std::string key_beginning(std::string_view public_key) {
  constexpr std::size_t shown = 8;
  return std::string(public_key.substr(0, shown)) + "...";
}

CurveKeyPair make_curve_keys() {
  KeyText public_key{};
  KeyText secret_key{};
  if (zmq_curve_keypair(public_key.data(), secret_key.data()) != 0) throw_no_curve();
  return {public_key.data(), secret_key.data()};
}

std::string public_key_of(const std::string& secret_key) {
  KeyText public_key{};
  if (zmq_curve_public(public_key.data(), secret_key.c_str()) != 0) throw_no_curve();
  return public_key.data();
}

}  // namespace splid::security
