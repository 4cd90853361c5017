#include "drivers/usb/usb_error.hpp"

#include <libusb.h>

namespace splid::usb {
namespace {

const char* advice(int code) {
  switch (code) {
    case LIBUSB_ERROR_ACCESS:
      return "; install systemd/60-splid.rules as /etc/udev/rules.d/60-splid.rules, join the group "
             "splid and plug it in again";
    case LIBUSB_ERROR_BUSY:
      return "; another program or a kernel driver uses it: end that program";
    case LIBUSB_ERROR_NO_MEM:
      return "; the kernel's room for USB buffers is used up: lower source.transfers or raise "
             "/sys/module/usbcore/parameters/usbfs_memory_mb";
    case LIBUSB_ERROR_PIPE:
      return "; it is halted again after it was cleared: switch it off and on again";
    case LIBUSB_ERROR_TIMEOUT:
      return "; it does not answer: plug it in again";
    default:
      return "";
  }
}

}  // namespace

// Where the device is gone, the sentence says so, whichever call found that out.
DeviceError::DeviceError(const std::string& device, const std::string& call, int code)
    : DeviceError(device + ": " +
                      (code == LIBUSB_ERROR_NO_DEVICE
                           ? std::string(unplugged)
                           : call + ": " + libusb_error_name(code) + advice(code)),
                  code) {}

bool DeviceError::device_is_gone() const { return code_ == LIBUSB_ERROR_NO_DEVICE; }

}  // namespace splid::usb
