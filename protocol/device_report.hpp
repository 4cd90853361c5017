#pragma once

#include <string>

namespace splid {

// What a driver knows of its instrument.
enum class DeviceState {
  connected,  // it is there and its data come, or will once there are any
  no_device,  // it is not there: unplugged, switched off, nobody listens at its address
  failing,    // it is there and does not do what it should
};

const char* to_string(DeviceState state);

// Said by a driver when something happens to its instrument. With `connected`, the reason tells of
// something that is over, such as a stall that was cleared.
struct DeviceReport {
  DeviceState state = DeviceState::connected;
  std::string reason;  // one sentence with the device's name; empty: nothing to say
  // The one that is read, as people tell it from others; empty: none, or the driver knows no more.
  std::string device = {};
  // One sentence that holds until the next report, such as that another could be meant; or empty.
  std::string caution = {};

  friend bool operator==(const DeviceReport&, const DeviceReport&) = default;
};

}  // namespace splid
