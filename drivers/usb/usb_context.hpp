#pragma once

#include <thread>

struct libusb_context;

namespace splid::usb {

// An instance of libusb.
//
// Threads: any. Errors: the constructor throws usb::DeviceError.
class Context {
 public:
  Context();
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  [[nodiscard]] libusb_context* get() const { return context_; }

 private:
  libusb_context* context_ = nullptr;
};

// The event thread of an instance of libusb: it takes the instance's events and runs the callbacks
// of its transfers, from construction to destruction.
class EventThread {
 public:
  // context: outlives this object.
  explicit EventThread(const Context& context);
  ~EventThread();
  EventThread(const EventThread&) = delete;
  EventThread& operator=(const EventThread&) = delete;

 private:
  libusb_context* context_;
  std::jthread thread_;
};

}  // namespace splid::usb
