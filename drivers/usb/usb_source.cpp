#include "drivers/usb/usb_source.hpp"

#include <utility>

#include "drivers/usb/usb_error.hpp"
#include "drivers/usb/usb_session.hpp"

namespace splid::usb {
namespace {

using std::chrono::milliseconds;

// 100 ms of 20 M tags/s in blocks of 16 bytes each.
constexpr std::size_t queue_bytes = 32 << 20;

// How often the source looks for the device; a look costs 30 us.
constexpr milliseconds between_looks{10};

// A transfer may break on a cable that is being pulled before the kernel has noticed.
constexpr milliseconds longest_farewell{60};

}  // namespace

void Options::describe(OptionVisitor& visitor) {
  visitor.text(
      "serial", serial,
      "serial number of the device, as splid devices lists it; empty: the first found, and "
      "no other until the stream ends");
  visitor.integer("transfers", transfers, 2, 128,
                  "transfers in flight; the kernel lends 16 MiB to all programs together");
  visitor.integer("transfer_kib", transfer_kib, 1, 8192, "length of a transfer, KiB");
}

Source::Source(InstrumentKind kind, Options options, SourceContext context)
    : kind_(std::move(kind)),
      options_(std::move(options)),
      choice_({kind_.ids, options_.serial}),
      context_(std::move(context)),
      queue_(queue_bytes) {}

SourceInfo Source::info() const { return {kind_.name, true, std::nullopt}; }

void Source::run(TagSink& sink, std::stop_token stop) {
  const Context context;
  const EventThread events(context);
  while (!stop.stop_requested()) {
    milliseconds pause = between_looks;
    try {
      run_session(context, sink, stop);
    } catch (const DeviceError& error) {
      if (!error.device_is_gone() && !vanishes(context, sink, stop)) {
        report(DeviceState::failing, error.what());
        pause = between_tries;
      } else if (last_report_.state != DeviceState::no_device) {
        // Otherwise the device was unplugged, which has been reported, and the kernel still lists
        // it: there is nothing new to report.
        report(DeviceState::no_device, error.device_is_gone() ? error.what() : choice_.absence());
      }
    }
    for (; pause.count() > 0 && !stop.stop_requested(); pause -= between_looks) {
      sink.publish(0);
      wake_.wait_for(between_looks);
    }
  }
}

void Source::run_session(const Context& context, TagSink& sink, const std::stop_token& stop) {
  const auto device = choice_.open(context);
  if (device == nullptr) {
    report(DeviceState::no_device, choice_.absence());
    return;
  }
  if (std::exchange(opened_before_, true)) counters_.reopens.fetch_add(1);
  const auto instrument = kind_.make();
  device->select_alternate(instrument->alternate_setting());
  BulkStream stream(*device, instrument->data_endpoint(),
                    static_cast<std::size_t>(options_.transfer_kib) << 10U, queue_, counters_,
                    wake_);
  Session session(
      *device, *instrument, stream, queue_, wake_,
      [this, moved = choice_.moved()](DeviceState state, const std::string& reason) mutable {
        const std::string first = std::exchange(moved, {});
        report(state, first.empty() || reason.empty() ? first + reason : first + "; " + reason);
      },
      [&] {
        // The reason of a fault still holds; the reason of a connected state was over when it
        // was told.
        const bool is_well = last_report_.state == DeviceState::connected;
        if (choice_.look(context)) report(last_report_.state, is_well ? "" : last_report_.reason);
      });
  session.run(static_cast<std::size_t>(options_.transfers), sink, stop);
}

bool Source::vanishes(const Context& context, TagSink& sink, const std::stop_token& stop) {
  for (auto left = longest_farewell; left.count() > 0; left -= between_looks) {
    if (!choice_.is_listed(context)) return true;
    if (stop.stop_requested()) break;
    sink.publish(0);
    wake_.wait_for(between_looks);
  }
  return false;
}

// A fault that lasts is reported once. A `connected` report tells of an event that is over, so each
// of them is reported, even with the words of the last report.
void Source::report(DeviceState state, const std::string& reason) {
  const bool is_there = state != DeviceState::no_device;
  const DeviceReport report{state, reason, is_there ? choice_.name() : "",
                            is_there ? choice_.caution() : ""};
  if (state != DeviceState::connected && report == last_report_) return;
  last_report_ = report;
  context_.report(report);
}

std::vector<SourceCounter> Source::counters() const {
  std::vector<SourceCounter> list = kind_.counters();
  for (std::size_t i = 0; i < Counters::statuses; ++i) {
    list.push_back({"splid_usb_transfers_total",
                    {{"status", transfer_status_name(i)}},
                    "Finished USB transfers by what came of them",
                    counters_.transfers.at(i)});
  }
  list.push_back({"splid_usb_bytes_total", {}, "Bytes read from the device", counters_.bytes});
  list.push_back({"splid_usb_dropped_bytes_total",
                  {},
                  "Bytes read but dropped, since decoding was too slow",
                  counters_.dropped_bytes});
  list.push_back(
      {"splid_usb_reopens_total", {}, "Times the device was opened again", counters_.reopens});
  return list;
}

}  // namespace splid::usb
