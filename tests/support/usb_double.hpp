#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/usb/usb_id.hpp"

namespace splid::test {

// What a device makes of the transfers that reach it.
//
// Threads: called from the double's, one call at a time.
class UsbFirmware {
 public:
  // Of an IN transfer: bytes written and 0, or a negative errno as the kernel gives it.
  struct Answer {
    std::size_t bytes = 0;
    int status = 0;
  };

  virtual ~UsbFirmware() = default;
  // Absent: nothing to send now. The transfer waits and is asked about again within 1 ms.
  virtual std::optional<Answer> read(std::uint8_t endpoint, std::span<std::byte> room) = 0;
  virtual void written(std::uint8_t endpoint, std::span<const std::byte> bytes) = 0;
  virtual void halt_cleared(std::uint8_t endpoint) = 0;
  virtual void alternate_selected(int setting) = 0;
  // Plugged in: as after power came.
  virtual void power_on() = 0;
};

struct UsbDoubleOptions {
  usb::Id id;
  std::string serial;
  std::vector<std::uint8_t> endpoints = {0x81};  // bulk, of both alternate settings
  int speed_mbit_s = 480;
  std::vector<std::uint8_t> endpoints_of_setting_1 = {};  // bulk, of that alternate setting alone
};

// An emulated kernel device (umockdev), on which libusb as it is runs, in this process or in
// another one that gets environment(). It can be plugged in and out; what it does is the
// firmware's.
//
// Threads: the caller's for its members; transfers are served on umockdev's own.
class UsbDouble {
 public:
  // firmware: outlives this. Not plugged in yet.
  UsbDouble(UsbDoubleOptions options, UsbFirmware& firmware);
  // Another one on the same bus, at port 2 to 6, where the first is at 1. beside: outlives this.
  UsbDouble(UsbDoubleOptions options, UsbFirmware& firmware, const UsbDouble& beside, int port = 2);
  ~UsbDouble();
  UsbDouble(const UsbDouble&) = delete;
  UsbDouble& operator=(const UsbDouble&) = delete;

  void plug();
  void unplug();
  // More in flight are refused with ENOMEM.
  void set_most_transfers(std::size_t transfers);
  [[nodiscard]] std::size_t transfers_in_flight() const;
  // What is written to it fails like this from now on, a negative errno as the kernel gives it:
  // -ENODEV before the transfers in flight come back, or -EPROTO as on a cable that is pulled.
  void fail_writes(int status);
  // For another process that is to see the device.
  [[nodiscard]] std::vector<std::string> environment() const;

 private:
  class Bus;
  std::unique_ptr<Bus> bus_;
};

}  // namespace splid::test
