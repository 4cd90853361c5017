#include "drivers/idq/source.hpp"

#include <chrono>
#include <utility>

#include "drivers/between_tries.hpp"
#include "drivers/idq/measurement.hpp"
#include "drivers/idq/time_controller.hpp"

namespace splid::idq {
namespace {

// Whoever waits for an answer was told to stop.
struct Stopped {};

}  // namespace

Source::Source(Options options, const SourceContext& context)
    : options_(std::move(options)), news_(context.report) {}

SourceInfo Source::info() const { return {"Time Controller", true, std::nullopt}; }

void Source::run(TagSink& sink, std::stop_token stop) {
  while (!stop.stop_requested()) {
    try {
      measure(sink, stop);
    } catch (const Stopped&) {
      return;
    } catch (const MeasurementOver& over) {
      news_.say({DeviceState::connected, std::string(over.what()) + "; its clock begins anew"});
    } catch (const NoAnswer& silence) {
      news_.say({DeviceState::no_device, silence.what()});
    } catch (const Refusal& refusal) {
      news_.say({DeviceState::failing, refusal.what()});
    }
    wait_between_tries(sink, stop);
  }
}

void Source::measure(TagSink& sink, const std::stop_token& stop) {
  TimeController controller(options_, [&] {
    if (stop.stop_requested()) throw Stopped{};
    sink.publish(0);
  });
  const Measurement::Report hears = [this](const DeviceReport& said) { news_.say(said); };
  Measurement(controller, options_, sink, hears).run(stop);
}

}  // namespace splid::idq
