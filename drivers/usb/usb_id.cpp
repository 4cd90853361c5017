#include "drivers/usb/usb_id.hpp"

#include <array>
#include <charconv>
#include <cstdio>

namespace splid::usb {
namespace {

std::optional<std::uint16_t> parse_part(const char* first) {
  const char* const last = first + 4;
  std::uint16_t value = 0;
  const auto result = std::from_chars(first, last, value, 16);
  if (result.ec != std::errc{} || result.ptr != last) return std::nullopt;
  return value;
}

}  // namespace

std::string to_string(const Id& id) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%04x:%04x", unsigned{id.vendor}, unsigned{id.product});
  return text.data();
}

std::optional<Id> parse_id(const std::string& text) {
  if (text.size() != 9 || text[4] != ':') return std::nullopt;
  const auto vendor = parse_part(text.data());
  const auto product = parse_part(text.data() + 5);
  if (!vendor || !product) return std::nullopt;
  return Id{*vendor, *product};
}

}  // namespace splid::usb
