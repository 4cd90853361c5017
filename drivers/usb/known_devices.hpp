#pragma once

#include <string>
#include <vector>

#include "drivers/usb/usb_device_list.hpp"

namespace splid::usb {

// A USB device that is plugged in, as `splid devices` shows it.
struct KnownDevice {
  DeviceInfo info;
  std::string driver;      // the driver that registered the device's id; empty: none did
  std::string bridge;      // what reads it where no driver does; empty: nothing known
  std::string instrument;  // that the bridge reads
  bool may_open = false;   // whether the device's permissions let this process open it
};

// The devices that are plugged in and whose id a driver or a bridge registered, or all devices.
// Sorted by bus and address.
//
// Threads: any. Errors: usb::DeviceError where libusb cannot start.
std::vector<KnownDevice> known_devices(bool all);

}  // namespace splid::usb
