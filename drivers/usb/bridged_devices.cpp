#include "drivers/usb/bridged_devices.hpp"

#include <algorithm>

namespace splid::usb {
namespace {

// Static in a function, so that it exists before the first file registers its devices.
std::vector<BridgedDevice>& all_bridged() {
  static std::vector<BridgedDevice> all;
  return all;
}

}  // namespace

bool register_bridged_devices(const std::vector<BridgedDevice>& devices) {
  all_bridged().insert(all_bridged().end(), devices.begin(), devices.end());
  return true;
}

const BridgedDevice* bridged_device(const Id& id) {
  const auto& all = all_bridged();
  const auto found = std::find_if(all.begin(), all.end(), [&id](const BridgedDevice& each) {
    return each.id == id || each.id == Id{id.vendor, 0};
  });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace splid::usb
