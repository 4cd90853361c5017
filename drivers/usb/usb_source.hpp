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

// The way of a tag from USB. A newcomer should read this header first, then in the order of the
// way:
//
//   bulk_stream     keeps transfers in flight; libusb's thread copies each finished one into
//   block_queue     a ring of bytes, from which the source's thread takes them:
//   usb_session     one stretch of streaming, from opening to loss or stop, hands each block to
//   usb_instrument  the interface that tdc2_instrument and tags16_usb implement: bytes become tags
//   usb_source      (this file) the TagSource around it all: waits for the device, opens it again
//
// usb_choice picks the device among those plugged in (usb_device_list), usb_device is the opened
// device, and known_devices is what `splid devices` shows.

namespace splid::usb {

// The keys that all USB drivers share: which device, and how much is in flight.
struct Options {
  std::string serial;           // empty: any
  std::int64_t transfers = 32;  // in flight
  std::int64_t transfer_kib = 256;

  void describe(OptionVisitor& visitor);
};

// What a driver tells usb::Source of the kind of instrument that it reads.
struct InstrumentKind {
  std::string name;     // for people
  std::vector<Id> ids;  // a device with any of these is such an instrument
  // Called each time that a device is opened; never empty.
  std::function<std::unique_ptr<Instrument>()> make;
  // What is counted beside the transfers; any thread; never empty.
  std::function<std::vector<SourceCounter>()> counters = [] {
    return std::vector<SourceCounter>{};
  };
};

// The tags of an instrument on USB, until a stop is requested. The source waits for the device to
// be plugged in, opens it, streams, and starts over when the device goes away or fails. Where
// several devices could be meant it stays with the device that it opened first, and each report
// cautions that there are others.
//
// What happens to the device is reported: no_device, failing (with what to do), connected. What
// that costs is in the stream: each stretch without the device is a loss of unknown count followed
// by a clock_break, and each failed transfer is a loss.
//
// Threads: run() starts one more, which takes libusb's events. Errors: Error(Fault::device) where
// libusb cannot start, Error(Fault::usage) where the device has no such endpoint; nothing else ends
// the stream. Timeouts: a stop takes 100 ms, or up to 1 s where the device does not answer.
class Source : public TagSource {
 public:
  // How long the source waits before it opens a device again that did not do what it should. It
  // looks for a missing device more often; opening keeps the device busy.
  static constexpr std::chrono::milliseconds between_tries{250};

  Source(InstrumentKind kind, Options options, SourceContext context);

  [[nodiscard]] SourceInfo info() const override;
  void run(TagSink& sink, std::stop_token stop) override;
  [[nodiscard]] std::vector<SourceCounter> counters() const override;

 private:
  void run_session(const Context& context, TagSink& sink, const std::stop_token& stop);
  // Whether a device that failed turns out to be unplugged within 60 ms.
  bool vanishes(const Context& context, TagSink& sink, const std::stop_token& stop);
  void report(DeviceState state, const std::string& reason);

  InstrumentKind kind_;
  Options options_;
  Choice choice_;
  SourceContext context_;
  Counters counters_;
  Wake wake_;
  BlockQueue queue_;
  bool opened_before_ = false;
  DeviceReport last_report_;
};

}  // namespace splid::usb
