#include "drivers/usb/usb_choice.hpp"

#include <libusb.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "drivers/usb/usb_error.hpp"

namespace splid::usb {
namespace {

struct Candidate {
  libusb_device* device;
  DeviceInfo info;
};

std::vector<Candidate> candidates(const DeviceList& list, const Selection& meant) {
  std::vector<Candidate> found;
  for (libusb_device* device : list.devices()) {
    DeviceInfo info = info_of(device);
    if (std::find(meant.ids.begin(), meant.ids.end(), info.id) == meant.ids.end()) continue;
    if (!meant.serial.empty() && info.serial != meant.serial) continue;
    found.push_back({device, std::move(info)});
  }
  // libusb lists devices in the order of their arrival, which differs from start to start.
  std::sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) {
    return std::tie(a.info.bus, a.info.port) < std::tie(b.info.bus, b.info.port);
  });
  return found;
}

std::vector<DeviceInfo> infos(const std::vector<Candidate>& found) {
  std::vector<DeviceInfo> list;
  list.reserve(found.size());
  for (const Candidate& each : found) list.push_back(each.info);
  return list;
}

std::string listed(const std::vector<DeviceInfo>& devices) {
  std::string text;
  for (const DeviceInfo& each : devices) text += (text.empty() ? "" : ", ") + in_words(each);
  return text;
}

// Whether the serial number does not tell the device from another.
bool has_double(const std::vector<DeviceInfo>& plugged_in, const DeviceInfo& read) {
  return std::count_if(plugged_in.begin(), plugged_in.end(),
                       [&](const DeviceInfo& each) { return each.serial == read.serial; }) > 1;
}

}  // namespace

std::string in_words(const Selection& selection) {
  std::string text = "USB device ";
  for (std::size_t i = 0; i < selection.ids.size(); ++i) {
    text += (i == 0 ? "" : " or ") + to_string(selection.ids[i]);
  }
  if (!selection.serial.empty()) text += " with serial " + selection.serial;
  return text;
}

std::unique_ptr<Device> Choice::open(const Context& context) {
  const DeviceList list(context);
  const std::vector<Candidate> found = candidates(list, meant_);
  const auto chosen = std::find_if(found.begin(), found.end(),
                                   [this](const Candidate& each) { return is_taken(each.info); });
  others_ = infos(found);
  if (chosen == found.end()) {
    caution_.clear();
    return nullptr;
  }
  judge(others_, chosen->info);
  auto device = std::make_unique<Device>(chosen->device, chosen->info);
  by_port_ = by_port_ || has_double(others_, chosen->info);
  moved_ = taken_ && taken_->port != chosen->info.port
               ? in_words(chosen->info) + ": it was at " + taken_->port + " before"
               : "";
  taken_ = chosen->info;
  return device;
}

bool Choice::look(const Context& context) {
  if (!taken_) return false;
  const std::string said = caution_;
  const std::vector<DeviceInfo> found = infos(candidates(DeviceList(context), meant_));
  by_port_ = by_port_ || has_double(found, *taken_);
  judge(found, *taken_);
  return caution_ != said;
}

bool Choice::is_listed(const Context& context) const {
  if (!taken_) return true;
  const DeviceList list(context);
  return std::any_of(list.devices().begin(), list.devices().end(), [this](libusb_device* device) {
    return libusb_get_bus_number(device) == taken_->bus &&
           libusb_get_device_address(device) == taken_->address;
  });
}

std::string Choice::absence() const {
  if (!taken_) {
    return "no " + in_words(meant_) + " is plugged in (splid devices lists what is)";
  }
  std::string text = name() + ": " + DeviceError::unplugged;
  if (others_.empty()) return text;
  return text + "; this stream stays with it and does not read " + listed(others_) +
         " in its place: plug it in again, or have the other read with splid ctl stop and "
         "splid ctl start";
}

bool Choice::is_taken(const DeviceInfo& info) const {
  if (!taken_) return true;
  if (by_port_) return info.port == taken_->port;
  return info.serial == taken_->serial;
}

void Choice::judge(const std::vector<DeviceInfo>& plugged_in, const DeviceInfo& read) {
  caution_.clear();
  if (plugged_in.size() < 2) return;
  caution_ = std::to_string(plugged_in.size()) +
             " devices that source could mean are plugged in (" + listed(plugged_in) + "), and " +
             in_words(read) + " is read: ";
  if (read.serial.empty()) {
    caution_ += "without serial numbers they are known by their ports, so unplug the other";
  } else if (has_double(plugged_in, read)) {
    caution_ += "of the same serial number they are known by their ports, so unplug the other";
  } else {
    caution_ += "set source.serial";
  }
}

}  // namespace splid::usb
