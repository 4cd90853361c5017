#include "drivers/usb/usb_device_list.hpp"

#include <libusb.h>

#include <array>
#include <cstdio>
#include <fstream>

#include "drivers/usb/usb_error.hpp"
#include "protocol/shown_text.hpp"

namespace splid::usb {
namespace {

int speed_mbit_s(libusb_device* device) {
  switch (libusb_get_device_speed(device)) {
    case LIBUSB_SPEED_LOW:
      return 1;
    case LIBUSB_SPEED_FULL:
      return 12;
    case LIBUSB_SPEED_HIGH:
      return 480;
    case LIBUSB_SPEED_SUPER:
      return 5000;
    case LIBUSB_SPEED_SUPER_PLUS:
      return 10000;
    default:
      return 0;
  }
}

std::string port_of(libusb_device* device) {
  std::array<std::uint8_t, 8> ports{};
  const int depth = libusb_get_port_numbers(device, ports.data(), ports.size());
  std::string bus = std::to_string(libusb_get_bus_number(device));
  if (depth <= 0) return "usb" + bus;
  std::string text = std::move(bus);
  for (int i = 0; i < depth; ++i) text += (i == 0 ? '-' : '.') + std::to_string(ports.at(i));
  return text;
}

// Design note: the kernel keeps the serial number that it read when the device was plugged in, and
// anybody may read it from the kernel. To ask the device takes permission to open it, and 1 ms of
// the bus.
std::string serial_of(const std::string& port) {
  std::ifstream file("/sys/bus/usb/devices/" + port + "/serial");
  std::string serial;
  std::getline(file, serial);
  return shown_text(serial, most_quoted);
}

}  // namespace

std::string DeviceInfo::node() const {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "/dev/bus/usb/%03d/%03d", bus, address);
  return text.data();
}

std::string in_words(const DeviceInfo& info) {
  std::string text = to_string(info.id);
  if (!info.serial.empty()) text += " serial " + info.serial;
  return text + " at " + info.port;
}

DeviceInfo info_of(libusb_device* device) {
  DeviceInfo info;
  libusb_device_descriptor descriptor{};
  libusb_get_device_descriptor(device, &descriptor);  // kept by libusb: does not fail
  info.id = {descriptor.idVendor, descriptor.idProduct};
  info.bus = libusb_get_bus_number(device);
  info.address = libusb_get_device_address(device);
  info.port = port_of(device);
  info.serial = serial_of(info.port);
  info.speed_mbit_s = speed_mbit_s(device);
  return info;
}

DeviceList::DeviceList(const Context& context) {
  const auto count = libusb_get_device_list(context.get(), &devices_);
  if (count < 0) throw DeviceError("libusb", "cannot list devices", static_cast<int>(count));
  count_ = static_cast<std::size_t>(count);
}

DeviceList::~DeviceList() { libusb_free_device_list(devices_, 1); }

}  // namespace splid::usb
