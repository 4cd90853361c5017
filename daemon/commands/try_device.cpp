#include "daemon/commands/try_device.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "config/option_reader.hpp"
#include "daemon/base/log.hpp"
#include "daemon/commands/tag_census.hpp"
#include "daemon/service/stop_signals.hpp"
#include "drivers/source.hpp"
#include "drivers/usb/known_devices.hpp"
#include "protocol/error.hpp"
#include "protocol/json_value.hpp"

namespace splid {
namespace {

using std::chrono::steady_clock;

// An instrument may take so long to start, and then so long to its first tag.
constexpr double start_patience_s = 10;
constexpr double tag_patience_s = 2;

// The tags of a source, counted from the first on.
class CensusSink final : public TagSink {
 public:
  std::span<Tag> claim(std::size_t max_count) override {
    return std::span(room_).first(std::min(max_count, room_.size()));
  }
  void publish(std::size_t count) override {
    if (count == 0) return;
    const std::lock_guard lock(mutex_);
    if (!has_begun_) begin_ = steady_clock::now();
    has_begun_ = true;
    census_.count(std::span(room_).first(count));
  }

  // Since the first tag; 0 where none came.
  [[nodiscard]] double seconds() const {
    const std::lock_guard lock(mutex_);
    if (!has_begun_) return 0;
    return std::chrono::duration<double>(steady_clock::now() - begin_).count();
  }
  [[nodiscard]] TagCensus census() const {
    const std::lock_guard lock(mutex_);
    return census_;
  }

 private:
  mutable std::mutex mutex_;
  TagCensus census_;
  bool has_begun_ = false;
  steady_clock::time_point begin_;
  std::vector<Tag> room_ = std::vector<Tag>(1 << 14);
};

// The block `source` of a configuration that reads what is there.
nlohmann::ordered_json source_at(const std::string& place) {
  if (place.starts_with("unix:") || place.starts_with("tcp:")) {
    return {{"driver", "bridge"}, {"address", place}};
  }
  for (const usb::KnownDevice& each : usb::known_devices(true)) {
    if (fmt::format("{:03}:{:03}", each.info.bus, each.info.address) != place) continue;
    if (!each.bridge.empty()) {
      throw Error(Fault::usage, place + ": a " + each.instrument + " is read by " + each.bridge +
                                    ": start that, and try its socket");
    }
    nlohmann::ordered_json source = {{"driver", each.driver.empty() ? "tags16-usb" : each.driver}};
    if (each.driver.empty()) source["usb_id"] = to_string(each.info.id);
    if (!each.info.serial.empty()) source["serial"] = each.info.serial;
    return source;
  }
  throw Error(Fault::device, "there is no device at " + place +
                                 "; splid devices lists the places: BUS:DEV of USB, unix:PATH and "
                                 "tcp:HOST:PORT");
}

std::unique_ptr<SourceOptions> options_of(const nlohmann::ordered_json& source,
                                          const std::string& place) {
  auto options = make_source_options(source["driver"].get<std::string>());
  nlohmann::json keys = source;
  keys.erase("driver");
  OptionReader reader(keys, place, "");
  options->describe(reader);
  reader.finish();
  if (const auto fault = options->validate()) throw Error(Fault::usage, fault->what);
  return options;
}

double seconds_since(steady_clock::time_point begin) {
  return std::chrono::duration<double>(steady_clock::now() - begin).count();
}

void say_report(const DeviceReport& report) {
  for (const std::string& words : {report.reason, report.caution}) {
    if (!words.empty()) log_warning("{}: {}", to_string(report.state), words);
  }
}

// Counts for so long after the first sign of life.
void count_tags(const SourceOptions& options, double seconds, CensusSink& sink) {
  const StopSignals signals;
  const Pattern none;
  SourceContext context;
  context.pattern = &none;
  context.warn = [](const std::string& sentence) { log_warning(sentence); };
  std::atomic<bool> is_connected = false;
  context.report = [&is_connected](const DeviceReport& report) {
    say_report(report);
    if (report.state == DeviceState::connected) is_connected = true;
  };
  const std::unique_ptr<TagSource> source = options.open(context);
  std::exception_ptr failure;
  {
    const std::jthread thread([&](const std::stop_token& stop) {
      try {
        source->run(sink, stop);
      } catch (const Error&) {
        failure = std::current_exception();
      }
    });
    const auto begin = steady_clock::now();
    std::optional<steady_clock::time_point> connected;
    const auto waits = [&] {
      const double counted = sink.seconds();
      if (counted > 0) return counted < seconds;
      if (is_connected && !connected) connected = steady_clock::now();
      return connected ? seconds_since(*connected) < std::max(seconds, tag_patience_s)
                       : seconds_since(begin) < start_patience_s;
    };
    while (waits() && !signals.token().stop_requested()) {
      std::this_thread::sleep_for(std::chrono::milliseconds{10});
    }
  }
  if (failure) std::rethrow_exception(failure);
}

void print_census(const TagCensus& census, double seconds) {
  for (const auto& [name, channel] : census.channels()) {
    const bool is_input = name.find_first_not_of("-0123456789") == std::string::npos;
    std::printf("%-12s %12.0f /s", ((is_input ? "input " : "") + name).c_str(),
                static_cast<double>(channel.tags) / seconds);
    if (channel.period_ps) std::printf("   one each %.3f ns", *channel.period_ps * 1e-3);
    std::printf("\n");
  }
  std::printf("losses       %12llu", static_cast<unsigned long long>(census.losses()));
  if (census.lost_tags() > 0) {
    std::printf(", %llu tags or more", static_cast<unsigned long long>(census.lost_tags()));
  }
  std::printf("\n");
}

nlohmann::ordered_json config_for(const nlohmann::ordered_json& source, const TagCensus& census) {
  nlohmann::ordered_json channels;
  for (const std::string& input : census.photons()) channels["photon"].push_back(std::stoi(input));
  channels["sync"] = census.sync();
  return {{"schema", "splid.config"},
          {"v", {1, 0}},
          {"source", source},
          {"channels", channels},
          {"pattern", {{"file", "PATTERN.json"}}}};
}

}  // namespace

int try_device(const std::string& place, double seconds) {
  const nlohmann::ordered_json source = source_at(place);
  CensusSink sink;
  count_tags(*options_of(source, place), seconds, sink);
  const double counted = sink.seconds();
  const TagCensus census = sink.census();
  if (census.channels().empty()) {
    throw Error(
        Fault::device,
        place + (counted > 0 ? fmt::format(": no tag came in {:.1f} s: look at its inputs and "
                                           "thresholds",
                                           counted)
                             : ": it sends nothing"));
  }
  print_census(census, counted);
  std::printf("\n%s\n", indented_json_text(config_for(source, census)).c_str());
  if (census.sync().empty()) {
    log_warning("no input is regular: connect the pattern's sync, and name its input as sync");
  }
  return 0;
}

}  // namespace splid
