#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace splid::usb {

// The kind of a USB device, as the device itself gives it.
struct Id {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;

  friend bool operator==(const Id&, const Id&) = default;
};

// "3137:200a", as lsusb prints it.
std::string to_string(const Id& id);

// Absent where the text is not two times four hexadecimal digits with a colon between.
std::optional<Id> parse_id(const std::string& text);

}  // namespace splid::usb
