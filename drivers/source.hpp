#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "drivers/usb/usb_id.hpp"
#include "protocol/device_report.hpp"
#include "protocol/options.hpp"
#include "protocol/pattern.hpp"
#include "protocol/pixel.hpp"
#include "protocol/scan_lines.hpp"
#include "protocol/tag.hpp"

// drivers/ turns instruments, recordings and simulated scenes into streams of tags. A newcomer
// should read this header first: it says what a driver is (SourceOptions and TagSource), where its
// tags go (TagSink), and how it announces itself (register_source).
//
//   replay/     a recording, played again
//   simulator/  a scene from first principles
//   usb/        instruments on USB; usb/usb_source.hpp tells the way of a tag from there
//   bridge/     instruments whose vendor's library serves tags16 blocks over a socket
//   encoder/    the counts of an encoder on the target, to compare the frames with
//   awg/        the waveform generator that plays the pattern; it is no source of tags

namespace splid {

// Where a source puts its tags: room in the ring (or in a test's vector), which the source decodes
// into directly.
//
// Threads: the source's only. Errors: none. Timeouts: for a source that is not live, claim() waits
// for room as long as it takes. For a live source it returns at once: while the ring is full it
// gives scratch room, whose tags publish() counts as a loss in the stream (loss_begin, loss_end).
class TagSink {
 public:
  virtual ~TagSink() = default;
  // Gives contiguous room for 1 to max_count tags; empty only once a stop was requested.
  virtual std::span<Tag> claim(std::size_t max_count) = 0;
  // Hands on the first `count` tags of the room that was claimed last. A count of 0 needs no claim.
  virtual void publish(std::size_t count) = 0;
};

struct SourceInfo {
  std::string name;   // driver and instrument, for people
  bool live = false;  // it produces tags at its own pace and cannot wait
  // UTC at device time 0. Where absent, the daemon takes the host's clock.
  std::optional<double> start_unix_s;
  // The syncs were counted and not timed: times are in the generator's own clock, in which a
  // pattern period has one length, so that its drift and jitter are unknown.
  bool syncs_are_counted = false;
  // The scan that a recording's header or a simulated scanner tells of; absent where there is none.
  std::optional<ScanLines> scan = {};
};

// Something that a driver counts, for the metrics.
struct SourceCounter {
  std::string name;  // in Prometheus' manner, such as splid_usb_transfers_total
  std::map<std::string, std::string> labels;  // values by name, such as status: stall
  std::string help;                           // what is counted, in a sentence
  std::uint64_t value = 0;                    // since the source was opened
};

class EncoderSource;
struct EncoderOptions;

// A stream of tags: an instrument, a recording or a simulated scene.
//
// Threads: run() is called once, on a thread of its own; info() before it. run() returns when the
// stream ends or soon (< 100 ms) after a stop is requested.
// Errors: throws Error (Fault::device or Fault::data) naming its place; tags that were published
// before stay published.
// Timeouts: a live source publishes a heartbeat at least every 10 ms when it has nothing else.
// While its instrument is gone, and tells no time, the source calls publish(0) at least ten times a
// second. These calls tell the watchdog that the source waits; it ends a source that hangs.
class TagSource {
 public:
  virtual ~TagSource() = default;
  [[nodiscard]] virtual SourceInfo info() const = 0;
  virtual void run(TagSink& sink, std::stop_token stop) = 0;
  // Any thread, at any time. The names and their order do not change.
  [[nodiscard]] virtual std::vector<SourceCounter> counters() const { return {}; }
};

// What a source may need to know beyond its own options.
struct SourceContext {
  const Pattern* pattern = nullptr;  // the configured pattern; never null
  // The configured pixels, in their order; empty where there is one, of channels.photon.
  std::vector<PixelOptions> pixels = {};
  // Takes one sentence for people. Never empty.
  std::function<void(const std::string&)> warn = [](const std::string&) {};
  // Takes what happened to the instrument. It may be called from any thread, but not on the way of
  // a tag, since it locks. Never empty.
  std::function<void(const DeviceReport&)> report = [](const DeviceReport&) {};
};

// The inputs that photons may come on: numbers from `least` to `most`, `count` of them at a time.
struct InputRange {
  std::int64_t least = 0, most = 0;
  std::size_t count = 0;
};

// A driver's block of options under `source` in the configuration; see OptionVisitor.
class SourceOptions {
 public:
  virtual ~SourceOptions() = default;
  virtual void describe(OptionVisitor& visitor) = 0;
  [[nodiscard]] virtual std::optional<OptionFault> validate() const { return std::nullopt; }
  // The instrument's inputs; absent where the driver does not know them, which is the default.
  [[nodiscard]] virtual std::optional<InputRange> inputs() const { return std::nullopt; }
  // What would make open() or run() fail at every start, as far as the files that the options name
  // tell it without the instrument; absent where nothing is wrong. May read files.
  [[nodiscard]] virtual std::optional<OptionFault> start_fault() const { return std::nullopt; }
  // Errors: Error as for TagSource::run.
  [[nodiscard]] virtual std::unique_ptr<TagSource> open(const SourceContext& context) const = 0;
  // The counts of an encoder that comes with the source, as a simulated scene may have one; null
  // where none does, which is the default.
  [[nodiscard]] virtual std::unique_ptr<EncoderSource> own_encoder(
      const EncoderOptions& options) const;
};

using MakeSourceOptions = std::function<std::unique_ptr<SourceOptions>()>;

// Announces a driver; each has one line of this at namespace scope beside its class:
//   const bool registered = register_source("replay", std::make_unique<ReplayOptions>);
// usb_ids: what a USB device calls itself that this driver reads. `splid devices` lists such
// devices, and systemd/60-splid.rules gives people access to them.
// Returns true. Called before main, from one thread.
bool register_source(const std::string& name, MakeSourceOptions make,
                     std::vector<usb::Id> usb_ids = {});

// Null where no driver has that name.
std::unique_ptr<SourceOptions> make_source_options(const std::string& name);

// The names of all drivers, in alphabetical order.
std::vector<std::string> source_names();

// The ids that a driver registered; none where no driver has that name.
std::vector<usb::Id> usb_ids_of(const std::string& name);

}  // namespace splid
