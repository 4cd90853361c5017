#include "drivers/bridge/bridge.hpp"

#include <algorithm>
#include <span>
#include <thread>
#include <utility>

#include "drivers/usb/bridged_devices.hpp"
#include "protocol/shown_text.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds shortest_pause{100};
constexpr milliseconds longest_pause{2000};
constexpr milliseconds block_patience{1000};
constexpr milliseconds silence_patience{3000};

// The longest look at the socket, and the longest sleep: a stop waits no longer.
constexpr milliseconds slice{20};

// Design note: a socket hands on some 200 KB at a time; more room would never be filled.
constexpr std::size_t buffer_bytes = 1 << 18;

const bool bridge_registered = register_source("bridge", std::make_unique<BridgeOptions>);

// Swabian's instruments have a module of Opal Kelly's, whose number others have too.
const bool swabian_registered = usb::register_bridged_devices(
    {{{0x151f, 0}, "Opal Kelly module (Swabian Time Tagger)", "swabian_bridge.py"}});

void sleep(milliseconds time, TagSink& sink, const std::stop_token& stop) {
  const auto until = steady_clock::now() + time;
  do {
    sink.publish(0);
    if (steady_clock::now() >= until) return;
    std::this_thread::sleep_for(slice);
  } while (!stop.stop_requested());
}

}  // namespace

void BridgeOptions::describe(OptionVisitor& visitor) {
  visitor.text("address", address,
               "where the bridge listens: unix:PATH or tcp:HOST:PORT; it sends tags16 blocks");
  visitor.require("address");
}

std::optional<OptionFault> BridgeOptions::validate() const {
  const std::optional<std::string> fault = socket_address_fault(address);
  if (!fault) return std::nullopt;
  return OptionFault{"/address", "\"" + address + "\" " + *fault};
}

std::unique_ptr<TagSource> BridgeOptions::open(const SourceContext& context) const {
  return std::make_unique<BridgeSource>(*this, context);
}

BridgeSource::BridgeSource(const BridgeOptions& options, SourceContext context)
    : context_(std::move(context)), socket_(options.address), buffer_(buffer_bytes) {}

SourceInfo BridgeSource::info() const {
  return {"bridge at " + socket_.address(), true, std::nullopt};
}

void BridgeSource::run(TagSink& sink, std::stop_token stop) {
  while (!stop.stop_requested()) {
    if (socket_.is_open()) {
      read(sink);
    } else {
      connect(sink, stop);
    }
  }
  socket_.close();
}

void BridgeSource::connect(TagSink& sink, const std::stop_token& stop) {
  sleep(pause_, sink, stop);
  pause_ = std::clamp(2 * pause_, shortest_pause, longest_pause);
  if (!socket_.connect(stop)) {
    if (!stop.stop_requested()) report({DeviceState::no_device, socket_.failure()});
    return;
  }
  instrument_ = {};
  connections_.fetch_add(1, std::memory_order_relaxed);
  connected_ = heard_ = block_seen_ = steady_clock::now();
}

void BridgeSource::read(TagSink& sink) {
  const std::size_t bytes = socket_.read(buffer_, slice);
  if (bytes > 0) {
    const auto now = steady_clock::now();
    // What comes first after a silence may be a part of a block.
    if (now - heard_ > block_patience) block_seen_ = now;
    heard_ = now;
    stream_.feed(std::span(buffer_).first(bytes), sink);
  } else {
    sink.publish(0);
  }
  if (socket_.is_open()) watch_blocks();
  if (socket_.is_open()) return;
  stream_.cut();
  report({DeviceState::no_device, socket_.failure()});
}

void BridgeSource::watch_blocks() {
  const auto now = steady_clock::now();
  const std::string news = news_.since_last(stream_.counts(), now);
  // Each such damage is new, and is over when it is told.
  if (!news.empty()) {
    tell(socket_.address() + ": " + news);
  }
  heed_bridge();
  if (stream_.counts().blocks != blocks_) {
    blocks_ = stream_.counts().blocks;
    block_seen_ = now;
    if (now - connected_ > block_patience) pause_ = milliseconds{0};
    report(instrument_);
  } else if (now - heard_ > silence_patience) {
    socket_.end("silent for 3 s; connecting anew");
  } else if (now - block_seen_ > block_patience) {
    report({DeviceState::failing,
            socket_.address() +
                (now - heard_ > block_patience
                     ? ": connected, but nothing came for a second; a bridge sends a block every "
                       "10 ms or sooner"
                     : ": what comes is no tags16 block of version 1; look at "
                       "docs/reference/tags16.md")});
  }
}

void BridgeSource::heed_bridge() {
  const auto text = [](const Notice& notice) {
    return shown_text(notice.text, tags16::max_text_bytes);
  };
  const Notice state = stream_.notice();
  if (state.number != notices_) {
    notices_ = state.number;
    if (state.kind == NoticeKind::caution) {
      instrument_ = {DeviceState::connected, "", "", text(state)};
    } else {
      const bool is_absent = state.kind == NoticeKind::absent;
      instrument_ = {is_absent ? DeviceState::no_device : DeviceState::failing, text(state)};
    }
  }
  const Notice event = stream_.event();
  if (event.number == events_) return;
  events_ = event.number;
  tell(text(event));
}

// An event ends with its report. A lasting state stays; a lasting fault is reported again.
void BridgeSource::tell(const std::string& event) {
  context_.report({instrument_.state, event, "", instrument_.caution});
  if (instrument_.state != DeviceState::connected) report_.reset();
}

// Reports changes only, since each report locks and goes to the log.
void BridgeSource::report(const DeviceReport& report) {
  if (report_ == report) return;
  report_ = report;
  context_.report(report);
}

std::vector<SourceCounter> BridgeSource::counters() const {
  std::vector<SourceCounter> all = counters_.list();
  all.push_back({"splid_bridge_connections_total",
                 {},
                 "Connections made to the bridge.",
                 connections_.load(std::memory_order_relaxed)});
  return all;
}

}  // namespace splid
