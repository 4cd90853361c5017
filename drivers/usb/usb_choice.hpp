#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/usb/usb_device.hpp"

namespace splid {

// Which device is meant.
struct UsbSelection {
  std::vector<UsbId> ids;  // any of these
  std::string serial;      // empty: any
};

// "USB device 3137:200a or 04b4:123a with serial TDC2-0042", for people.
std::string in_words(const UsbSelection& selection);

// Which of the devices that are plugged in a stream reads: of those that are meant the one at the
// first port, and from then on no other. It is known by its serial number; one without is known by
// its port, where others of its kind were plugged in when it was opened, and by nothing else.
//
// Design note: two instruments of one kind are wired to different detectors. Frames of the other
// one, taken when a cable is pulled, would look like frames of the first.
//
// Threads: one. Errors: UsbError.
class UsbChoice {
 public:
  explicit UsbChoice(UsbSelection meant) : meant_(std::move(meant)) {}

  // Null where it is not plugged in.
  std::unique_ptr<UsbDevice> open(const UsbContext& context);
  // Looks anew what is plugged in; whether caution() says something else then.
  bool look(const UsbContext& context);
  // The device that was opened last is still there.
  [[nodiscard]] bool is_listed(const UsbContext& context) const;

  // The device that is read, for people; empty before the first was opened.
  [[nodiscard]] std::string name() const { return taken_ ? in_words(*taken_) : ""; }
  // That others could be meant, and what to do; empty: none could.
  [[nodiscard]] const std::string& caution() const { return caution_; }
  // Why open() found none: never empty.
  [[nodiscard]] std::string absence() const;

 private:
  [[nodiscard]] bool is_taken(const UsbDeviceInfo& info) const;
  void judge(const std::vector<UsbDeviceInfo>& plugged_in, const UsbDeviceInfo& read);

  UsbSelection meant_;
  std::optional<UsbDeviceInfo> taken_;
  bool by_port_ = false;               // taken_ is known by its port
  std::vector<UsbDeviceInfo> others_;  // meant, but not taken, as last looked
  std::string caution_;
};

}  // namespace splid
