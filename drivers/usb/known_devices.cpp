#include "drivers/usb/known_devices.hpp"

#include <unistd.h>

#include <algorithm>
#include <tuple>

#include "drivers/source.hpp"
#include "drivers/usb/bridged_devices.hpp"

namespace splid::usb {
namespace {

// Empty where no driver registered that id.
std::string driver_of(const Id& id) {
  for (const std::string& name : source_names()) {
    const std::vector<Id> ids = usb_ids_of(name);
    if (std::find(ids.begin(), ids.end(), id) != ids.end()) return name;
  }
  return "";
}

}  // namespace

std::vector<KnownDevice> known_devices(bool all) {
  const Context context;
  const DeviceList list(context);
  std::vector<KnownDevice> devices;
  for (libusb_device* plugged_in : list.devices()) {
    KnownDevice device;
    device.info = info_of(plugged_in);
    device.driver = driver_of(device.info.id);
    const BridgedDevice* bridged = bridged_device(device.info.id);
    if (device.driver.empty() && bridged != nullptr) {
      device.bridge = bridged->bridge;
      device.instrument = bridged->instrument;
    }
    if (device.driver.empty() && device.bridge.empty() && !all) continue;
    device.may_open = ::access(device.info.node().c_str(), R_OK | W_OK) == 0;
    devices.push_back(std::move(device));
  }
  std::sort(devices.begin(), devices.end(), [](const KnownDevice& a, const KnownDevice& b) {
    return std::tie(a.info.bus, a.info.address) < std::tie(b.info.bus, b.info.address);
  });
  return devices;
}

}  // namespace splid::usb
