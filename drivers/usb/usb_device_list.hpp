#pragma once

#include <span>
#include <string>

#include "drivers/usb/usb_context.hpp"
#include "drivers/usb/usb_id.hpp"

struct libusb_device;

namespace splid::usb {

// What a device tells without being opened.
struct DeviceInfo {
  Id id;
  int bus = 0;
  int address = 0;
  std::string port;                        // as /sys/bus/usb/devices names it, such as 1-1.2
  std::string serial;                      // empty: the device has none
  int speed_mbit_s = 0;                    // 12, 480, 5000, 10000; 0: unknown
  [[nodiscard]] std::string node() const;  // /dev/bus/usb/001/002
};

// "3137:200a serial TDC2-0042 at 1-1.2", for people.
std::string in_words(const DeviceInfo& info);

DeviceInfo info_of(libusb_device* device);

// The devices that are plugged in now.
//
// Threads: one. Errors: the constructor throws usb::DeviceError.
class DeviceList {
 public:
  // context: outlives this object.
  explicit DeviceList(const Context& context);
  ~DeviceList();
  DeviceList(const DeviceList&) = delete;
  DeviceList& operator=(const DeviceList&) = delete;

  [[nodiscard]] std::span<libusb_device* const> devices() const { return {devices_, count_}; }

 private:
  libusb_device** devices_ = nullptr;
  std::size_t count_ = 0;
};

}  // namespace splid::usb
