#pragma once

#include <thread>

struct libusb_context;

namespace splid {

// An instance of libusb.
//
// Threads: any. Errors: the constructor throws UsbError.
class UsbContext {
 public:
  UsbContext();
  ~UsbContext();
  UsbContext(const UsbContext&) = delete;
  UsbContext& operator=(const UsbContext&) = delete;

  [[nodiscard]] libusb_context* get() const { return context_; }

 private:
  libusb_context* context_ = nullptr;
};

// The event thread of an instance of libusb: it takes the instance's events and runs the callbacks
// of its transfers, from construction to destruction.
class UsbEventThread {
 public:
  // context: outlives this object.
  explicit UsbEventThread(const UsbContext& context);
  ~UsbEventThread();
  UsbEventThread(const UsbEventThread&) = delete;
  UsbEventThread& operator=(const UsbEventThread&) = delete;

 private:
  libusb_context* context_;
  std::jthread thread_;
};

}  // namespace splid
