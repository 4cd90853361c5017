#include "drivers/usb/usb_device.hpp"

#include <libusb.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "drivers/usb/usb_error.hpp"

namespace splid {
namespace {

constexpr int interface_number = 0;

std::string hex(std::uint8_t value) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "0x%02x", unsigned{value});
  return text.data();
}

bool is_meant(const UsbDeviceInfo& info, const UsbSelection& selection) {
  return std::find(selection.ids.begin(), selection.ids.end(), info.id) != selection.ids.end() &&
         (selection.serial.empty() || info.serial == selection.serial);
}

}  // namespace

std::string describe(const UsbSelection& selection) {
  std::string text = "USB device ";
  for (std::size_t i = 0; i < selection.ids.size(); ++i) {
    text += (i == 0 ? "" : " or ") + to_string(selection.ids[i]);
  }
  if (!selection.serial.empty()) text += " with serial " + selection.serial;
  return text;
}

std::unique_ptr<UsbDevice> UsbDevice::open(const UsbContext& context,
                                           const UsbSelection& selection) {
  const UsbDeviceList list(context);
  for (libusb_device* device : list.devices()) {
    const UsbDeviceInfo info = info_of(device);
    if (!is_meant(info, selection)) continue;
    return std::unique_ptr<UsbDevice>(new UsbDevice(device, describe(info)));
  }
  return nullptr;
}

UsbDevice::UsbDevice(libusb_device* device, std::string name) : name_(std::move(name)) {
  check(libusb_open(device, &handle_), "cannot open it");
  libusb_set_auto_detach_kernel_driver(handle_, 1);  // where the system cannot, the claim says so
  const int code = libusb_claim_interface(handle_, interface_number);
  if (code == 0) return;
  libusb_close(handle_);
  check(code, "cannot claim interface 0");
}

UsbDevice::~UsbDevice() {
  libusb_release_interface(handle_, interface_number);
  libusb_close(handle_);
}

void UsbDevice::select_alternate(int setting) {
  check(libusb_set_interface_alt_setting(handle_, interface_number, setting),
        "cannot select alternate setting " + std::to_string(setting));
}

int UsbDevice::max_packet_bytes(std::uint8_t endpoint) const {
  libusb_config_descriptor* config = nullptr;
  check(libusb_get_active_config_descriptor(libusb_get_device(handle_), &config),
        "cannot read its configuration");
  int bytes = 0;
  std::string known;
  for (int i = 0; i < config->bNumInterfaces; ++i) {
    const libusb_interface& interface = config->interface[i];
    for (const auto& setting : std::span(interface.altsetting, interface.num_altsetting)) {
      for (const auto& found : std::span(setting.endpoint, setting.bNumEndpoints)) {
        if ((found.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_BULK) continue;
        known += ' ' + hex(found.bEndpointAddress);
        if (found.bEndpointAddress == endpoint) bytes = found.wMaxPacketSize;
      }
    }
  }
  libusb_free_config_descriptor(config);
  if (bytes == 0) {
    throw Error(Fault::usage, name_ + ": it has no bulk endpoint " + hex(endpoint) + "; it has" +
                                  (known.empty() ? " none" : known));
  }
  return bytes;
}

void UsbDevice::write(std::uint8_t endpoint, std::span<const std::byte> bytes,
                      std::chrono::milliseconds timeout) {
  // libusb's buffers are not const, though nothing is written into those of OUT endpoints.
  auto* data = reinterpret_cast<unsigned char*>(const_cast<std::byte*>(bytes.data()));
  int written = 0;
  const int code = libusb_bulk_transfer(handle_, endpoint, data, static_cast<int>(bytes.size()),
                                        &written, static_cast<unsigned>(timeout.count()));
  check(code, "cannot write to endpoint " + hex(endpoint));
}

std::size_t UsbDevice::read(std::uint8_t endpoint, std::span<std::byte> room,
                            std::chrono::milliseconds timeout) {
  int count = 0;
  const int code = libusb_bulk_transfer(
      handle_, endpoint, reinterpret_cast<unsigned char*>(room.data()),
      static_cast<int>(room.size()), &count, static_cast<unsigned>(timeout.count()));
  if (code != LIBUSB_ERROR_TIMEOUT) check(code, "cannot read from endpoint " + hex(endpoint));
  return static_cast<std::size_t>(count);
}

void UsbDevice::clear_halt(std::uint8_t endpoint) {
  check(libusb_clear_halt(handle_, endpoint),
        "cannot clear the stall of endpoint " + hex(endpoint));
}

void UsbDevice::check(int code, const std::string& call) const {
  if (code < 0) throw UsbError(name_, call, code);
}

}  // namespace splid
