#include "drivers/usb/usb_listing.hpp"

#include <unistd.h>

#include <algorithm>
#include <tuple>

#include "drivers/usb/tdc2.hpp"

namespace splid {
namespace {

std::string driver_of(const UsbId& id) {
  return std::find(tdc2_ids.begin(), tdc2_ids.end(), id) != tdc2_ids.end() ? "tdc2" : "";
}

}  // namespace

std::vector<UsbListing> list_usb_devices(bool all) {
  const UsbContext context;
  const UsbDeviceList list(context);
  std::vector<UsbListing> listings;
  for (libusb_device* device : list.devices()) {
    UsbListing listing{info_of(device), "", false};
    listing.driver = driver_of(listing.info.id);
    if (listing.driver.empty() && !all) continue;
    listing.may_open = ::access(listing.info.node().c_str(), R_OK | W_OK) == 0;
    listings.push_back(std::move(listing));
  }
  std::sort(listings.begin(), listings.end(), [](const UsbListing& a, const UsbListing& b) {
    return std::tie(a.info.bus, a.info.address) < std::tie(b.info.bus, b.info.address);
  });
  return listings;
}

}  // namespace splid
