#include "drivers/usb/usb_device.hpp"

#include <libusb.h>

#include <array>
#include <cstdio>
#include <utility>
#include <vector>

#include "drivers/usb/usb_error.hpp"

namespace splid::usb {
namespace {

constexpr int interface_number = 0;

std::string hex(std::uint8_t value) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "0x%02x", unsigned{value});
  return text.data();
}

// A bulk endpoint, and the interface and setting that it belongs to.
struct Endpoint {
  std::uint8_t address = 0;
  int packet_bytes = 0;
  int interface = 0;
  int setting = 0;
};

std::vector<Endpoint> bulk_endpoints(const libusb_config_descriptor& config) {
  std::vector<Endpoint> all;
  for (const auto& interface : std::span(config.interface, config.bNumInterfaces)) {
    for (const auto& setting : std::span(interface.altsetting, interface.num_altsetting)) {
      for (const auto& found : std::span(setting.endpoint, setting.bNumEndpoints)) {
        if ((found.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_BULK) continue;
        all.push_back({found.bEndpointAddress, found.wMaxPacketSize, setting.bInterfaceNumber,
                       setting.bAlternateSetting});
      }
    }
  }
  return all;
}

// What to do about an endpoint that the selected alternate setting does not have.
std::string describe_missing(std::uint8_t address, int setting, const std::vector<Endpoint>& all) {
  std::string here;
  const Endpoint* elsewhere = nullptr;
  for (const Endpoint& each : all) {
    if (each.interface == interface_number && each.setting == setting) {
      here += ' ' + hex(each.address);
    }
    // An endpoint of interface 0 can be configured, an endpoint of another interface cannot.
    if (each.address == address && (elsewhere == nullptr || each.interface == interface_number)) {
      elsewhere = &each;
    }
  }
  const std::string has = here.empty() ? " none" : here;
  if (elsewhere == nullptr) return "it has no bulk endpoint " + hex(address) + "; it has" + has;
  const std::string belongs = "its bulk endpoint " + hex(address) + " belongs to ";
  if (elsewhere->interface != interface_number) {
    return belongs + "interface " + std::to_string(elsewhere->interface) +
           ", and splid reads interface 0, which has" + has;
  }
  const std::string other = std::to_string(elsewhere->setting);
  return belongs + "alternate setting " + other + ", and setting " + std::to_string(setting) +
         " is in use, which has" + has + ": set source.alternate_setting to " + other;
}

}  // namespace

Device::Device(libusb_device* device, const DeviceInfo& info) : name_(in_words(info)) {
  check(libusb_open(device, &handle_), "cannot open it");
  libusb_set_auto_detach_kernel_driver(handle_, 1);  // where the system cannot, the claim says so
  const int code = libusb_claim_interface(handle_, interface_number);
  if (code == 0) return;
  libusb_close(handle_);
  check(code, "cannot claim interface 0");
}

Device::~Device() {
  libusb_release_interface(handle_, interface_number);
  libusb_close(handle_);
}

void Device::select_alternate(int setting) {
  if (setting == alternate_) return;
  check(libusb_set_interface_alt_setting(handle_, interface_number, setting),
        "cannot select alternate setting " + std::to_string(setting));
  alternate_ = setting;
}

int Device::max_packet_bytes(std::uint8_t endpoint) const {
  libusb_config_descriptor* config = nullptr;
  check(libusb_get_active_config_descriptor(libusb_get_device(handle_), &config),
        "cannot read its configuration");
  const std::vector<Endpoint> all = bulk_endpoints(*config);
  libusb_free_config_descriptor(config);
  for (const Endpoint& each : all) {
    if (each.address == endpoint && each.interface == interface_number &&
        each.setting == alternate_) {
      return each.packet_bytes;
    }
  }
  throw Error(Fault::usage, name_ + ": " + describe_missing(endpoint, alternate_, all));
}

void Device::write(std::uint8_t endpoint, std::span<const std::byte> bytes,
                   std::chrono::milliseconds timeout) {
  // libusb's buffers are not const, though nothing is written into those of OUT endpoints.
  auto* data = reinterpret_cast<unsigned char*>(const_cast<std::byte*>(bytes.data()));
  const int code =
      transfer(endpoint, {data, bytes.size()}, static_cast<unsigned>(timeout.count())).code;
  check(code, "cannot write to endpoint " + hex(endpoint));
}

std::size_t Device::read(std::uint8_t endpoint, std::span<std::byte> room,
                         std::chrono::milliseconds timeout) {
  const Transferred done =
      transfer(endpoint, {reinterpret_cast<unsigned char*>(room.data()), room.size()},
               static_cast<unsigned>(timeout.count()));
  if (done.code != LIBUSB_ERROR_TIMEOUT) {
    check(done.code, "cannot read from endpoint " + hex(endpoint));
  }
  return done.bytes;
}

// An endpoint may be halted since before the device was opened: it is cleared, once.
Device::Transferred Device::transfer(std::uint8_t endpoint, std::span<unsigned char> data,
                                     unsigned timeout_ms) {
  const auto try_it = [&] {
    int bytes = 0;
    const int code = libusb_bulk_transfer(handle_, endpoint, data.data(),
                                          static_cast<int>(data.size()), &bytes, timeout_ms);
    return Transferred{code, static_cast<std::size_t>(bytes)};
  };
  const Transferred done = try_it();
  if (done.code != LIBUSB_ERROR_PIPE) return done;
  clear_halt(endpoint);
  cleared_ = "its endpoint " + hex(endpoint) + " was halted and was cleared";
  return try_it();
}

std::string Device::take_cleared() { return std::exchange(cleared_, {}); }

void Device::clear_halt(std::uint8_t endpoint) {
  check(libusb_clear_halt(handle_, endpoint),
        "cannot clear the stall of endpoint " + hex(endpoint));
}

void Device::check(int code, const std::string& call) const {
  if (code < 0) throw DeviceError(name_, call, code);
}

}  // namespace splid::usb
