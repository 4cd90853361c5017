#include "drivers/picoquant/source.hpp"

#include <memory>
#include <utility>

#include "drivers/between_tries.hpp"
#include "drivers/picoquant/device.hpp"
#include "drivers/picoquant/measurement.hpp"

namespace splid::picoquant {
Source::Source(Options options, const SourceContext& context)
    : options_(std::move(options)), news_(context.report), serial_(options_.serial) {}

SourceInfo Source::info() const { return {traits_of(options_.family).product, true, std::nullopt}; }

void Source::run(TagSink& sink, std::stop_token stop) {
  std::unique_ptr<Library> library;
  const Measurement::Report hears = [this](const DeviceReport& said) { news_.say(said); };
  while (!stop.stop_requested()) {
    try {
      if (!library) library = std::make_unique<Library>(options_.family, options_.library, watch_);
      Device device(*library, options_, serial_);
      serial_ = device.serial();
      Measurement(device, library->traits(), sink, hears).run(stop);
    } catch (const DeviceAbsent& absent) {
      news_.say({DeviceState::no_device, absent.what()});
    } catch (const LibraryError& error) {
      if (error.device_is_gone()) {
        news_.say({DeviceState::no_device, named(error) + ": it was unplugged or switched off"});
      } else {
        news_.say({DeviceState::failing, named(error)});
      }
    }
    wait_between_tries(sink, stop);
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

}  // namespace splid::picoquant
