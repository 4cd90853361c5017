#pragma once

#include <string>
#include <vector>

#include "drivers/usb/usb_list.hpp"

namespace splid {

// A device as `splid devices` shows it.
struct UsbListing {
  UsbDeviceInfo info;
  std::string driver;     // that knows it by its id; empty: none
  bool may_open = false;  // by its permissions
};

// What is plugged in and known to a driver, or everything. Sorted by bus and address.
//
// Threads: any. Errors: UsbError where libusb cannot start.
std::vector<UsbListing> list_usb_devices(bool all);

}  // namespace splid
