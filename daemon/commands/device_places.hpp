#pragma once

#include <string>
#include <vector>

namespace splid {

// Where an instrument is, and what reads it.
struct DevicePlace {
  std::string place;       // BUS:DEV, unix:PATH or tcp:HOST:PORT
  std::string reader;      // of it; empty: nothing
  std::string what;        // further words for people
  bool is_closed = false;  // this user may not open it
};

// The USB devices that a driver or a bridge reads, or all.
//
// Errors: usb::DeviceError where libusb cannot start.
std::vector<DevicePlace> usb_places(bool all);

// The sockets of bridges below a folder such as /run: FOLDER/splid-bridge-NAME/tags.sock and
// FOLDER/splid/bridge.sock.
std::vector<DevicePlace> socket_places(const std::string& folder);

// What configurations of splid and of bridges name: an instrument on the network, and sockets.
// Files that cannot be read, and other documents, name nothing.
std::vector<DevicePlace> configured_places(const std::vector<std::string>& files);

}  // namespace splid
