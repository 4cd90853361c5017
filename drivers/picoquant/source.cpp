#include "drivers/picoquant/source.hpp"

#include <memory>
#include <thread>
#include <utility>

#include "drivers/picoquant/device.hpp"
#include "drivers/picoquant/measurement.hpp"

namespace splid::picoquant {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds between_tries{500};
constexpr milliseconds between_signs{10};  // of life

}  // namespace

Source::Source(Options options, SourceContext context)
    : options_(std::move(options)), context_(std::move(context)), serial_(options_.serial) {}

SourceInfo Source::info() const { return {traits_of(options_.family).product, true, std::nullopt}; }

void Source::run(TagSink& sink, std::stop_token stop) {
  std::unique_ptr<Library> library;
  const Measurement::Report hears = [this](const DeviceReport& said) { report(said); };
  while (!stop.stop_requested()) {
    try {
      if (!library) library = std::make_unique<Library>(options_.family, options_.library, watch_);
      Device device(*library, options_, serial_);
      serial_ = device.serial();
      Measurement(device, library->traits(), sink, hears).run(stop);
    } catch (const DeviceAbsent& absent) {
      report({DeviceState::no_device, absent.what()});
    } catch (const LibraryError& error) {
      if (error.device_is_gone()) {
        report({DeviceState::no_device, named(error) + ": it was unplugged or switched off"});
      } else {
        report({DeviceState::failing, named(error)});
      }
    }
    wait(sink, stop);
  }
}

std::string Source::overdue_call() const {
  const char* name = watch_.overdue();
  return name == nullptr ? std::string() : traits_of(options_.family).prefix + std::string(name);
}

// The error with the instrument that it is of.
std::string Source::named(const LibraryError& error) const {
  const std::string product = traits_of(options_.family).product;
  return product + (serial_.empty() ? "" : " " + serial_) + ": " + error.what();
}

// What holds is reported once. An event, told with the state connected, is reported each time.
void Source::report(const DeviceReport& said) {
  const bool is_event = said.state == DeviceState::connected && !said.reason.empty();
  if (!is_event && report_ == said) return;
  report_ = said;
  if (is_event) report_->reason.clear();
  context_.report(said);
}

void Source::wait(TagSink& sink, const std::stop_token& stop) {
  for (auto left = between_tries; left.count() > 0 && !stop.stop_requested();
       left -= between_signs) {
    sink.publish(0);
    std::this_thread::sleep_for(between_signs);
  }
}

}  // namespace splid::picoquant
