#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "drivers/source.hpp"
#include "drivers/usb/bulk_stream.hpp"
#include "drivers/usb/usb_choice.hpp"
#include "drivers/usb/usb_instrument.hpp"

namespace splid {

// Which device, and how much is in flight: the keys that all USB drivers share.
struct UsbOptions {
  std::vector<UsbId> ids;
  std::string serial;           // empty: any
  std::int64_t transfers = 32;  // in flight
  std::int64_t transfer_kib = 256;

  // All but the ids.
  void describe(OptionVisitor& visitor);
};

// Tags of an instrument on USB, for as long as asked: waits for the device to be plugged in, opens
// it, streams, and starts over when it goes or fails. Of several that are meant it stays with the
// one that it opened first, and each report cautions that there are others.
//
// What happens to the device is reported: no_device, failing (with what to do), connected. What it
// costs is in the stream: each stretch without the device is a loss of unknown count followed by a
// clock_break, each failed transfer a loss.
//
// Threads: run() has one more, which takes libusb's events. Errors: Error(Fault::device) where
// libusb cannot start, Error(Fault::usage) where the device has no such endpoint; nothing else ends
// the stream. Timeouts: a stop takes 100 ms, where the device does not answer up to 1 s.
class UsbSource : public TagSource {
 public:
  using MakeInstrument = std::function<std::unique_ptr<UsbInstrument>()>;

  // Opening a device that does not do what it should is tried less often than looking for one, so
  // that it is not kept busy with that.
  static constexpr std::chrono::milliseconds between_tries{250};

  // name: of the instrument, for people.
  UsbSource(std::string name, UsbOptions options, MakeInstrument make, SourceContext context);

  [[nodiscard]] SourceInfo info() const override;
  void run(TagSink& sink, std::stop_token stop) override;
  [[nodiscard]] std::vector<SourceCounter> counters() const override;

 private:
  void run_session(const UsbContext& context, TagSink& sink, const std::stop_token& stop);
  // Whether a device that failed is gone within a moment.
  bool vanishes(const UsbContext& context, TagSink& sink, const std::stop_token& stop);
  void report(DeviceState state, const std::string& reason);

  std::string name_;
  UsbOptions options_;
  UsbChoice choice_;
  MakeInstrument make_;
  SourceContext context_;
  UsbCounters counters_;
  Wake wake_;
  BlockQueue queue_;
  bool opened_before_ = false;
  DeviceReport last_report_;
};

}  // namespace splid
