#pragma once

#include <string>
#include <vector>

#include "drivers/usb/usb_id.hpp"

namespace splid::usb {

// A USB instrument that a bridge reads with its maker's library, and no driver.
struct BridgedDevice {
  Id id;                   // product 0: any of the vendor's
  std::string instrument;  // for people
  std::string bridge;      // the command that reads it
};

// Announces such instruments, as register_source() announces drivers. Returns true. Called before
// main, from one thread.
bool register_bridged_devices(const std::vector<BridgedDevice>& devices);

// Null where no bridge reads a device of that id.
const BridgedDevice* bridged_device(const Id& id);

}  // namespace splid::usb
