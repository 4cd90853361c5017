#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "protocol/device_report.hpp"
#include "protocol/options.hpp"
#include "protocol/pattern.hpp"
#include "protocol/tag.hpp"

namespace splid {

// Where a source puts its tags: room in the ring (or in a test's vector), decoded into directly.
//
// Threads: the source's only. Errors: none. Timeouts: claim() waits for room as long as it takes
// when the source is not live; for a live one it returns at once, with scratch room whose tags
// publish() counts as a loss in the stream (loss_begin, loss_end) when the ring is full.
class TagSink {
 public:
  virtual ~TagSink() = default;
  // Contiguous room for 1 to max_count tags; empty only once a stop was requested.
  virtual std::span<Tag> claim(std::size_t max_count) = 0;
  // The first count tags of the last claim are written. count may be 0, also without a claim.
  virtual void publish(std::size_t count) = 0;
};

struct SourceInfo {
  std::string name;   // driver and instrument, for people
  bool live = false;  // produces at its own pace and cannot wait
  std::optional<double>
      start_unix_s;  // UTC at device time 0; absent: the daemon takes the host's clock
};

// Something that a driver counts, for the metrics.
struct SourceCounter {
  std::string name;         // Prometheus' way, such as splid_usb_transfers_total
  std::string label;        // such as status="stall"; empty: none
  std::string help;         // what is counted, in a sentence
  std::uint64_t value = 0;  // since the source was opened
};

// A stream of tags: an instrument, a recording or a simulated scene.
//
// Threads: run() is called once, on a thread of its own; info() before it. run() returns when the
// stream ends or soon (< 100 ms) after a stop is requested.
// Errors: throws Error (Fault::device or Fault::data) naming its place; tags published before stay.
// Timeouts: a live source publishes a heartbeat at least every 10 ms when it has nothing else.
// Where its instrument is gone, and tells no time, it publishes no tags ten times a second at
// least: so a source that waits is told from one that hangs, which the watchdog ends.
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
  const Pattern* pattern = nullptr;  // the configured one; never null
  // One sentence for people; never empty.
  std::function<void(const std::string&)> warn = [](const std::string&) {};
  // What happened to the instrument; any thread, but not on the way of a tag: it locks. Never
  // empty.
  std::function<void(const DeviceReport&)> report = [](const DeviceReport&) {};
};

// A driver's block of options under `source` in the configuration; see OptionVisitor.
class SourceOptions {
 public:
  virtual ~SourceOptions() = default;
  virtual void describe(OptionVisitor& visitor) = 0;
  [[nodiscard]] virtual std::optional<OptionFault> validate() const { return std::nullopt; }
  // What open() or run() would stumble over at every start, told by the files that the options
  // name and without the instrument; absent where nothing is wrong. May read files.
  [[nodiscard]] virtual std::optional<OptionFault> start_fault() const { return std::nullopt; }
  // Errors: Error as for TagSource::run.
  [[nodiscard]] virtual std::unique_ptr<TagSource> open(const SourceContext& context) const = 0;
};

using MakeSourceOptions = std::function<std::unique_ptr<SourceOptions>()>;

// Announces a driver; each has one line of this at namespace scope beside its class:
//   const bool registered = register_source("replay", std::make_unique<ReplayOptions>);
// Returns true. Called before main, from one thread.
bool register_source(const std::string& name, MakeSourceOptions make);

// Null where no driver has that name.
std::unique_ptr<SourceOptions> make_source_options(const std::string& name);

// In alphabetical order.
std::vector<std::string> source_names();

}  // namespace splid
