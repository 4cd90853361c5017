#include "drivers/usb/usb_session.hpp"

#include <libusb.h>

#include <algorithm>
#include <array>
#include <utility>

#include "drivers/usb/usb_error.hpp"

namespace splid::usb {
namespace {

using std::chrono::milliseconds;

// How long an idle loop sleeps: heartbeats are due every 10 ms.
constexpr milliseconds idle{2};

// How many bytes are decoded before the instrument is tended again: 20 ms at 200 MB/s.
constexpr std::size_t most_bytes = 4 << 20;

// An instrument that owes data every 10 ms has been due five times when its silence is reported;
// the status is published within 50 ms more.
constexpr milliseconds silence_reported{50};

// A device whose transfers fail one after another is reported ten times a second.
constexpr milliseconds between_reports{100};

constexpr milliseconds between_looks_around{1000};

// An endpoint that sends nothing for so long is quiet.
constexpr milliseconds quiet{5};

}  // namespace

Session::Session(Device& device, Instrument& instrument, BulkStream& stream, BlockQueue& queue,
                 Wake& wake, Report report, LookAround look_around)
    : device_(device),
      instrument_(instrument),
      stream_(stream),
      queue_(queue),
      wake_(wake),
      report_(std::move(report)),
      look_around_(std::move(look_around)),
      cuts_(queue.cuts()),
      reported_cuts_(cuts_),
      reported_drops_(queue.drops()) {}

void Session::run(std::size_t transfers, TagSink& sink, const std::stop_token& stop) {
  // Blocks of the session before belong to an instrument that is gone.
  while (queue_.front()) queue_.pop();
  start(transfers);
  try {
    stream_until(stop, sink);
  } catch (const DeviceError&) {
    // The bytes that came before the end are still good.
    stream_.stop();
    while (decode_queued(sink)) {
    }
    instrument_.end(sink);
    throw;
  }
  // The instrument is stopped before the transfers, so that no data is left in it.
  try {
    instrument_.stop(device_);
  } catch (const DeviceError&) {
    // The instrument is no longer needed. If the fault lasts, the next start reports it.
  }
  stream_.stop();
}

void Session::start(std::size_t transfers) {
  instrument_.prepare(device_);
  std::array<std::byte, 16384> stale;
  const auto deadline = Clock::now() + longest_drain;
  while (device_.read(instrument_.data_endpoint(), stale, quiet) > 0 && Clock::now() < deadline) {
  }
  transfers_ = stream_.start(transfers);
  instrument_.start(device_);
  heard_ = Clock::now();
  std::string told = device_.take_cleared();
  if (transfers_ != transfers) {
    told += (told.empty() ? "" : "; ") + std::string("the kernel had room for ") +
            std::to_string(transfers_) + " of " + std::to_string(transfers) + " transfers only";
  }
  report_(DeviceState::connected, told.empty() ? told : device_.name() + ": " + told);
}

void Session::stream_until(const std::stop_token& stop, TagSink& sink) {
  while (!stop.stop_requested()) {
    const bool any = decode_queued(sink);
    const std::string told = instrument_.tend(device_, sink);
    for (const std::string& each : {told, device_.take_cleared()}) {
      if (!each.empty()) report_(DeviceState::connected, device_.name() + ": " + each);
    }
    report_failures();
    recover();
    watch_silence();
    look_around();
    if (any) continue;
    sink.publish(0);
    wake_.wait_for(idle);
  }
}

// False where the queue was empty.
bool Session::decode_queued(TagSink& sink) {
  const std::uint32_t cuts = queue_.cuts();
  std::size_t bytes = 0;
  while (bytes < most_bytes) {
    const auto block = queue_.front();
    if (!block) {
      take_cuts(cuts, sink);
      break;
    }
    take_cuts(block->cuts, sink);
    instrument_.decode(block->bytes, sink);
    bytes += block->bytes.size();
    queue_.pop();
  }
  if (bytes == 0) return false;
  const auto now = Clock::now();
  if (silent_) {
    const auto silence = std::chrono::duration_cast<milliseconds>(now - heard_);
    report_(DeviceState::connected,
            device_.name() + ": it sent nothing for " + std::to_string(silence.count()) + " ms");
    silent_ = false;
  }
  heard_ = now;
  return true;
}

void Session::take_cuts(std::uint32_t cuts, TagSink& sink) {
  // Cuts are counted in the order of the stream, so that a smaller count is older.
  if (static_cast<std::int32_t>(cuts - cuts_) <= 0) return;
  cuts_ = cuts;
  instrument_.cut(sink);
}

void Session::report_failures() {
  if (reported_cuts_ == cuts_ || Clock::now() < next_report_) return;
  // A stall is reported when its endpoint is cleared, and may have cost no tag.
  const std::uint32_t stalls = stream_.stalls() - reported_stalls_;
  const std::uint32_t cuts = cuts_ - reported_cuts_;
  const std::uint32_t losses = cuts - std::min(cuts, stalls);
  // More may have been dropped behind the bytes that are decoded by now.
  const std::uint32_t drops = std::min(losses, queue_.drops() - reported_drops_);
  const std::uint32_t failures = losses - drops;
  reported_cuts_ = cuts_;
  reported_stalls_ += stalls;
  reported_drops_ += drops;
  if (losses == 0) return;
  next_report_ = Clock::now() + between_reports;
  std::string told;
  if (drops > 0) {
    told =
        "this machine decodes too slowly, and " + std::to_string(drops) + " transfers were dropped";
  }
  if (failures > 0) {
    told += (told.empty() ? "" : "; ") + ("tags were lost in " + std::to_string(failures)) +
            " transfers; the last failure was " + stream_.last_failure();
  }
  report_(DeviceState::connected, device_.name() + ": " + told);
}

void Session::look_around() {
  const auto now = Clock::now();
  if (now < next_look_) return;
  next_look_ = now + between_looks_around;
  look_around_();
}

void Session::watch_silence() {
  if (!instrument_.owes_data()) return;
  const auto silence = Clock::now() - heard_;
  if (silence < silence_reported) return;
  if (silence >= silence_ended) {
    throw DeviceError(device_.name() + ": it has sent nothing for 2 s; it is opened anew", 0);
  }
  if (silent_) return;
  silent_ = true;
  report_(DeviceState::failing, device_.name() +
                                    ": it sends nothing, not even an empty block; look whether "
                                    "it runs");
}

void Session::recover() {
  const unsigned trouble = stream_.trouble();
  if (trouble == BulkStream::none) return;
  if ((trouble & BulkStream::gone) != 0) device_.check(LIBUSB_ERROR_NO_DEVICE, "it was unplugged");
  if ((trouble & BulkStream::failing) != 0) {
    throw DeviceError(device_.name() + ": " + std::to_string(BulkStream::max_failures) +
                          " transfers in a row failed, the last of " + stream_.last_failure() +
                          "; it is opened anew; look at its cable",
                      0);
  }
  if ((trouble & BulkStream::stalled) != 0) {
    restart(transfers_, "its endpoint stalled and was cleared; tags may be missing");
  } else {
    restart((transfers_ + 1) / 2, "the kernel had no more room for USB buffers");
  }
}

void Session::restart(std::size_t transfers, const std::string& why) {
  if (!stream_.stop()) throw DeviceError(device_.name() + ": its transfers do not come back", 0);
  if ((stream_.trouble() & BulkStream::stalled) != 0) {
    device_.clear_halt(instrument_.data_endpoint());
  }
  transfers_ = stream_.start(transfers);
  report_(DeviceState::connected, device_.name() + ": " + why + "; " + std::to_string(transfers_) +
                                      " transfers are in flight");
}

}  // namespace splid::usb
