#pragma once

#include <cstdint>
#include <string>

#include "daemon/base/clock.hpp"
#include "protocol/status_json.hpp"

namespace splid {

// Tells the service manager how the daemon does, by systemd's protocol (sd_notify(3)): READY=1 once
// the first frame is out, or the status tells that the daemon waits for its instrument or what
// keeps it from measuring; STATUS= with the words of the status message, WATCHDOG=1 while something
// comes of its work, STOPPING=1. Does nothing where nobody listens (NOTIFY_SOCKET is not set).
//
// Threads: one thread calls tick(); reloading() and reloaded() may be called from another. Errors:
// none.
class ServiceNotifier {
 public:
  // clock: outlives this. Looks WATCHDOG_USEC up.
  explicit ServiceNotifier(const Clock& clock);

  // To be called at least ten times a second. alive: the daemon's work goes on (see Liveness).
  // While it does not, the watchdog is not fed, and the service manager ends the process once the
  // watchdog's time is over.
  void tick(const StatusMessage& status, bool alive);
  void reloading();
  void reloaded();

 private:
  void send_status(const StatusMessage& status);

  const Clock& clock_;
  std::int64_t feed_interval_ns_ = 0;  // 0: no watchdog
  std::int64_t fed_ns_ = 0;
  std::int64_t told_ns_ = 0;
  bool ready_ = false;
  bool stopping_ = false;
  std::string told_;
};

// "ok: 1,200 frames, 1,190 with a target, 0 tags lost; the reason".
std::string in_words(const StatusMessage& status);

}  // namespace splid
