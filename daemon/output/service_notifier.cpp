#include "daemon/output/service_notifier.hpp"

#include <systemd/sd-daemon.h>

#include "daemon/base/text.hpp"

namespace splid {
namespace {

constexpr std::int64_t notice_interval_ns = 1'000'000'000;
constexpr std::int64_t ns_per_us = 1000;

std::string headline_of(const StatusMessage& status) {
  return headline(to_string(status.state), status.measurement);
}

}  // namespace

ServiceNotifier::ServiceNotifier(const Clock& clock) : clock_(clock) {
  std::uint64_t watchdog_us = 0;
  if (sd_watchdog_enabled(0, &watchdog_us) > 0) {
    // The watchdog is fed four times in its time, so that a feed that is late by half of the time
    // does no harm.
    feed_interval_ns_ = static_cast<std::int64_t>(watchdog_us) * ns_per_us / 4;
  }
}

void ServiceNotifier::tick(const StatusMessage& status, bool alive) {
  const std::int64_t now_ns = clock_.steady_ns();
  if (!ready_ && (status.frames > 0 || status.state == DaemonState::waiting_for_device ||
                  status.state == DaemonState::degraded)) {
    ready_ = true;
    sd_notify(0, "READY=1");
  }
  if (!stopping_ && status.state == DaemonState::stopping) {
    stopping_ = true;
    sd_notify(0, "STOPPING=1");
  }
  if (alive && feed_interval_ns_ > 0 && now_ns - fed_ns_ >= feed_interval_ns_) {
    fed_ns_ = now_ns;
    sd_notify(0, "WATCHDOG=1");
  }
  send_status(status);
}

void ServiceNotifier::reloading() {
  sd_notifyf(0, "RELOADING=1\nMONOTONIC_USEC=%lld",
             static_cast<long long>(clock_.steady_ns() / ns_per_us));
}

void ServiceNotifier::reloaded() { sd_notify(0, "READY=1"); }

// At most once a second, since the count of frames changes with every frame.
void ServiceNotifier::send_status(const StatusMessage& status) {
  const std::int64_t now_ns = clock_.steady_ns();
  const std::string said = headline_of(status) + status.reason;
  if (said == told_ && now_ns - told_ns_ < notice_interval_ns) return;
  told_ = said;
  told_ns_ = now_ns;
  sd_notify(0, ("STATUS=" + in_words(status)).c_str());
}

std::string in_words(const StatusMessage& status) {
  std::string text = headline_of(status) + ": " + grouped(status.frames) + " frames, " +
                     grouped(status.valid_frames) + " with a target, " + grouped(status.lost_tags) +
                     " tags lost";
  if (!status.reason.empty()) text += "; " + status.reason;
  return text;
}

}  // namespace splid
