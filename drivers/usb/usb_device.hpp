#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "drivers/usb/usb_device_list.hpp"

struct libusb_device_handle;

namespace splid::usb {

// An open device with interface 0 claimed, for calls that wait for their answer. A kernel driver
// that holds the interface is detached, and attached again when the device is closed.
//
// Threads: one, which is not the context's event thread. Errors: usb::DeviceError.
class Device {
 public:
  Device(libusb_device* device, const DeviceInfo& info);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] libusb_device_handle* handle() const { return handle_; }
  [[nodiscard]] const std::string& name() const { return name_; }

  // Selects an alternate setting of interface 0. A device that was just opened has setting 0, for
  // which nothing is sent.
  void select_alternate(int setting);
  // The packet size of a bulk endpoint of the selected alternate setting. Errors:
  // Error(Fault::usage) where the setting has no such endpoint, naming the setting that has.
  [[nodiscard]] int max_packet_bytes(std::uint8_t endpoint) const;
  // Both write() and read() clear a halted endpoint and try once more.
  void write(std::uint8_t endpoint, std::span<const std::byte> bytes,
             std::chrono::milliseconds timeout);
  // Returns how many bytes came; 0 where none came in time.
  std::size_t read(std::uint8_t endpoint, std::span<std::byte> room,
                   std::chrono::milliseconds timeout);
  void clear_halt(std::uint8_t endpoint);
  // What write() and read() cleared since the last call, in words; empty: nothing.
  [[nodiscard]] std::string take_cleared();

  // Throws a usb::DeviceError naming the device where code is negative.
  void check(int code, const std::string& call) const;

 private:
  struct Transferred {
    int code = 0;
    std::size_t bytes = 0;
  };
  Transferred transfer(std::uint8_t endpoint, std::span<unsigned char> data, unsigned timeout_ms);

  std::string name_;
  std::string cleared_;
  int alternate_ = 0;
  libusb_device_handle* handle_ = nullptr;
};

}  // namespace splid::usb
