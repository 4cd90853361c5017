#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "drivers/source.hpp"
#include "drivers/usb/usb_device.hpp"

namespace splid::usb {

// How to speak to one kind of instrument, and what its bytes mean: all that usb::Source does not
// know. An object of this class serves one opening of a device.
//
// Threads: the source's. Errors: usb::DeviceError, which has the device closed and opened again.
// Timeouts: a call may wait for the device for 250 ms, tend() and stop() for 30 ms.
class Instrument {
 public:
  virtual ~Instrument() = default;

  // The bulk IN endpoint that the data come from.
  [[nodiscard]] virtual std::uint8_t data_endpoint() const = 0;

  // The alternate setting of interface 0 that has the endpoints.
  [[nodiscard]] virtual int alternate_setting() const { return 0; }

  // Called before transfers are in flight: brings the instrument to where it may be started.
  virtual void prepare(Device&) {}
  // Called when transfers are in flight: has the instrument send.
  virtual void start(Device&) {}
  // Called every 2 ms or so, to make heartbeats and to ask the instrument how it is. Returns what
  // there is to report; empty: nothing.
  virtual std::string tend(Device&, TagSink&) { return {}; }
  // Stops the instrument in good order. An error that it throws is passed over.
  virtual void stop(Device&) {}

  // Turns the bytes of one transfer into tags.
  virtual void decode(std::span<const std::byte> bytes, TagSink& sink) = 0;
  // Bytes may be missing between the last decode() and the next.
  virtual void cut(TagSink& sink) = 0;
  // The instrument is gone or will be started anew: what is missing is a loss, and its clock ends.
  virtual void end(TagSink& sink) = 0;

  // Whether silence is a fault, because the instrument sends something every 10 ms.
  [[nodiscard]] virtual bool owes_data() const = 0;
};

}  // namespace splid::usb
