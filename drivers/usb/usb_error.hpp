#pragma once

#include <string>

#include "protocol/error.hpp"

namespace splid::usb {

// A call into libusb that failed, or a device that does not answer as it should.
class DeviceError : public Error {
 public:
  // What errors and reports say of a device that is gone, after its name.
  static constexpr const char* unplugged = "it was unplugged";

  // code: libusb's, negative; 0 where no call into libusb failed.
  DeviceError(const std::string& what, int code) : Error(Fault::device, what), code_(code) {}
  // device: for people. call: what was tried, as in "cannot open it".
  DeviceError(const std::string& device, const std::string& call, int code);

  [[nodiscard]] int code() const { return code_; }
  [[nodiscard]] bool device_is_gone() const;

 private:
  int code_;
};

}  // namespace splid::usb
