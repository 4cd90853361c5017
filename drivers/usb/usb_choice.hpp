#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/usb/usb_device.hpp"

namespace splid::usb {

// Which devices a configuration could mean.
struct Selection {
  std::vector<Id> ids;  // any of these
  std::string serial;   // empty: any
};

// "USB device 3137:200a or 04b4:123a with serial TDC2-0042", for people.
std::string in_words(const Selection& selection);

// Chooses which of the devices that are plugged in a stream reads: of those that the configuration
// could mean, the device at the first port, and from then on no other. A device is recognised by
// its serial number. A device whose serial number another has too, or which has none, is recognised
// by its port once both were plugged in; before that any device of this number is taken for it.
//
// Design note: two instruments of one kind are wired to different detectors. When a cable is
// pulled, frames of the other instrument would look like frames of the first.
//
// Threads: one. Errors: usb::DeviceError.
class Choice {
 public:
  explicit Choice(Selection meant) : meant_(std::move(meant)) {}

  // Opens the chosen device; null where it is not plugged in.
  std::unique_ptr<Device> open(const Context& context);
  // Looks again at what is plugged in. True where caution() has changed by that.
  bool look(const Context& context);
  // Whether the device that was opened last is still plugged in.
  [[nodiscard]] bool is_listed(const Context& context) const;

  // The device that is read, for people; empty before the first device was opened.
  [[nodiscard]] std::string name() const { return taken_ ? in_words(*taken_) : ""; }
  // Says that other devices could be meant, and what to do; empty where none could.
  [[nodiscard]] const std::string& caution() const { return caution_; }
  // Says that open() found the device at another port than before; empty where it did not.
  [[nodiscard]] const std::string& moved() const { return moved_; }
  // Why open() found no device; never empty.
  [[nodiscard]] std::string absence() const;

 private:
  [[nodiscard]] bool is_taken(const DeviceInfo& info) const;
  void judge(const std::vector<DeviceInfo>& plugged_in, const DeviceInfo& read);

  Selection meant_;
  std::optional<DeviceInfo> taken_;
  bool by_port_ = false;            // taken_ is recognised by its port, from now on
  std::vector<DeviceInfo> others_;  // could be meant, but are not read, at the last open()
  std::string caution_;
  std::string moved_;
};

}  // namespace splid::usb
