#include "daemon/service/bridging.hpp"

#include <systemd/sd-daemon.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <thread>

#include "daemon/base/clock.hpp"
#include "daemon/base/log.hpp"
#include "daemon/service/stop_signals.hpp"
#include "daemon/sockets/tag_server.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds between_rounds{50};

// A source publishes ten times a second, but for the time that a library takes to load an
// instrument's firmware: its call is then told to be overdue before this time is over.
constexpr std::int64_t longest_quiet_ns = 40'000'000'000;

// A source ends within 100 ms, or when the library's call has come to its end.
constexpr milliseconds stop_patience{2000};

// What the service manager is told.
class Notifier {
 public:
  Notifier() {
    std::uint64_t watchdog_us = 0;
    if (sd_watchdog_enabled(0, &watchdog_us) > 0) {
      interval_ns_ = static_cast<std::int64_t>(watchdog_us) * 1000 / 4;
    }
  }
  void feed(std::int64_t now_ns) {
    if (interval_ns_ == 0 || now_ns - fed_ns_ < interval_ns_) return;
    fed_ns_ = now_ns;
    sd_notify(0, "WATCHDOG=1");
  }

 private:
  std::int64_t interval_ns_ = 0;  // 0: no watchdog
  std::int64_t fed_ns_ = 0;
};

// Says on the log, and to the service manager, what the instrument reports.
void say(const DeviceReport& report) {
  std::string words = report.reason;
  if (!report.caution.empty()) words += (words.empty() ? "" : "; ") + report.caution;
  if (words.empty()) {
    const std::string name = report.device.empty() ? "the instrument" : report.device;
    log_info("{}: tags come", name);
    words = name + ": tags come";
  } else {
    log_warning("{}: {}", to_string(report.state), words);
  }
  std::replace(words.begin(), words.end(), '\n', ' ');
  sd_notify(0, ("STATUS=" + words).c_str());
}

// Nothing else can end a thread that is inside a library: neither its destructors nor those of the
// program would return.
[[noreturn]] void end_at_once(int exit_code) { std::_Exit(exit_code); }

}  // namespace

int run_bridge(const std::string& listen, const OpenBridged& open) {
  const StopSignals signals;
  sockets::TagServer server("listen", listen);
  const Pattern none;
  SourceContext context;
  context.pattern = &none;
  context.warn = [](const std::string& sentence) { log_warning(sentence); };
  context.report = [&server](const DeviceReport& report) {
    say(report);
    server.report(report);
  };
  BridgedInstrument bridged = open(context);
  log_info("{}: listening at {}", bridged.source->info().name, listen);
  sd_notify(0, "READY=1");  // before the source's first STATUS=
  std::atomic<bool> has_ended = false;
  std::jthread source([&](const std::stop_token& stop) {
    bridged.source->run(server, stop);
    has_ended = true;
  });
  Notifier notifier;
  const Clock& clock = host_clock();
  while (!signals.token().stop_requested()) {
    std::this_thread::sleep_for(between_rounds);
    const std::string call = bridged.overdue_call();
    if (!call.empty()) {
      log_error("{} has not returned: the library or the instrument hangs, and the bridge ends",
                call);
      end_at_once(static_cast<int>(Fault::device));
    }
    const std::int64_t now_ns = clock.steady_ns();
    if (now_ns - server.published_ns() < longest_quiet_ns) notifier.feed(now_ns);
  }
  sd_notify(0, "STOPPING=1");
  source.request_stop();
  for (auto left = stop_patience; left.count() > 0 && !has_ended; left -= between_rounds) {
    std::this_thread::sleep_for(between_rounds);
  }
  if (!has_ended) {
    log_warning("the library has not returned: the bridge ends without closing the instrument");
    end_at_once(0);
  }
  return 0;
}

}  // namespace splid
