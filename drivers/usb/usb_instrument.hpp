#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "drivers/source.hpp"
#include "drivers/usb/usb_device.hpp"

namespace splid {

// How one kind of instrument is spoken to, and what its bytes mean: all that UsbSource does not
// know. Made anew each time that a device is opened.
//
// Threads: the source's. Errors: UsbError, which has the device closed and opened again.
// Timeouts: a call may wait for the device for 250 ms, tend() and stop() for 30 ms.
class UsbInstrument {
 public:
  virtual ~UsbInstrument() = default;

  // Of the data, bulk IN.
  [[nodiscard]] virtual std::uint8_t data_endpoint() const = 0;

  // Of interface 0, that has the endpoints.
  [[nodiscard]] virtual int alternate_setting() const { return 0; }

  // Before transfers fly: brings the instrument to where it may be started.
  virtual void prepare(UsbDevice&) {}
  // Transfers fly: has the instrument send.
  virtual void start(UsbDevice&) {}
  // Called every 2 ms or so, for heartbeats and questions. Returns what there is to report.
  virtual std::string tend(UsbDevice&, TagSink&) { return {}; }
  // The orderly end. Its errors are not looked at.
  virtual void stop(UsbDevice&) {}

  // What one transfer brought.
  virtual void decode(std::span<const std::byte> bytes, TagSink& sink) = 0;
  // Bytes may be missing here.
  virtual void cut(TagSink& sink) = 0;
  // The instrument is gone or will be started anew: what is missing is a loss, and its clock ends.
  virtual void end(TagSink& sink) = 0;

  // Whether silence is a fault, since the instrument sends something every 10 ms.
  [[nodiscard]] virtual bool owes_data() const = 0;
};

// A loss of unknown count where the stream was, and that later times do not follow earlier ones.
void put_clock_end(std::int64_t time_ps, TagSink& sink);

}  // namespace splid
