#include "drivers/usb/usb_context.hpp"

#include <libusb.h>
#include <pthread.h>

#include <string>

#include "drivers/usb/usb_error.hpp"

namespace splid::usb {

Context::Context() {
  const int code = libusb_init(&context_);
  if (code == 0) return;
  // libusb returns LIBUSB_ERROR_OTHER (-99), before it touches any device, where the process may
  // not open netlink sockets.
  throw DeviceError("libusb",
                    code == LIBUSB_ERROR_OTHER ? "cannot start; a service needs AF_NETLINK in its "
                                                 "RestrictAddressFamilies to hear of devices"
                                               : "cannot start",
                    code);
}

Context::~Context() { libusb_exit(context_); }

EventThread::EventThread(const Context& context)
    : context_(context.get()), thread_([this](const std::stop_token& stop) {
        pthread_setname_np(pthread_self(), "usb-events");
        while (!stop.stop_requested()) {
          timeval event_patience{0, 100'000};  // the delay of a stop whose interrupt is lost
          libusb_handle_events_timeout_completed(context_, &event_patience, nullptr);
        }
      }) {}

EventThread::~EventThread() {
  thread_.request_stop();
  libusb_interrupt_event_handler(context_);
}

}  // namespace splid::usb
