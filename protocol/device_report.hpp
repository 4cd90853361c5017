#pragma once

#include <array>
#include <cstddef>
#include <string>

namespace splid {

// What a driver knows of its instrument.
enum class DeviceState {
  connected,  // the instrument is there and its data come, or will come once there are any
  no_device,  // it is not there: unplugged, switched off, or nobody listens at its address
  failing,    // it is there and does not do what it should
};

// The names in JSON, in the order of the enumerators.
inline constexpr std::array<const char*, 3> device_state_names = {"connected", "no_device",
                                                                  "failing"};

inline const char* to_string(DeviceState state) {
  return device_state_names.at(static_cast<std::size_t>(state));
}

// A driver sends a report when something happens to its instrument. With the state `connected`, the
// reason tells of something that is over, such as a stall that was cleared.
struct DeviceReport {
  DeviceState state = DeviceState::connected;
  std::string reason;  // one sentence with the device's name; empty: nothing to say
  // Which instrument is read, in words that tell people which of several it is; empty where none is
  // read, or the driver cannot tell.
  std::string device = {};
  // One sentence that holds until the next report, such as that another device could be meant;
  // may be empty.
  std::string caution = {};

  friend bool operator==(const DeviceReport&, const DeviceReport&) = default;
};

}  // namespace splid
