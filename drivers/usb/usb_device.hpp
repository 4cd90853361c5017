#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "drivers/usb/usb_list.hpp"

struct libusb_device_handle;

namespace splid {

// Which device is meant.
struct UsbSelection {
  std::span<const UsbId> ids;  // any of these
  std::string serial;          // empty: any
};

// "USB device 3137:200a or 04b4:123a with serial TDC2-0042", for people.
std::string describe(const UsbSelection& selection);

// An open device with interface 0 claimed, for calls that wait for their answer. A kernel driver
// that holds the interface is detached, and attached again at the end.
//
// Threads: one, but not that of the context's events. Errors: UsbError.
class UsbDevice {
 public:
  // The first that is meant; null where none is plugged in.
  static std::unique_ptr<UsbDevice> open(const UsbContext& context, const UsbSelection& selection);
  ~UsbDevice();
  UsbDevice(const UsbDevice&) = delete;
  UsbDevice& operator=(const UsbDevice&) = delete;

  [[nodiscard]] libusb_device_handle* handle() const { return handle_; }
  [[nodiscard]] const std::string& name() const { return name_; }

  void select_alternate(int setting);
  // Of a bulk endpoint. Errors: Error(Fault::usage) where the device has none such.
  [[nodiscard]] int max_packet_bytes(std::uint8_t endpoint) const;
  void write(std::uint8_t endpoint, std::span<const std::byte> bytes,
             std::chrono::milliseconds timeout);
  // Bytes read, 0 where none came in time.
  std::size_t read(std::uint8_t endpoint, std::span<std::byte> room,
                   std::chrono::milliseconds timeout);
  void clear_halt(std::uint8_t endpoint);

  // Throws an UsbError naming the device where code is negative.
  void check(int code, const std::string& call) const;

 private:
  UsbDevice(libusb_device* device, std::string name);

  std::string name_;
  libusb_device_handle* handle_ = nullptr;
};

}  // namespace splid
