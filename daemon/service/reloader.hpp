#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/output/device_monitor.hpp"
#include "daemon/output/service_notifier.hpp"
#include "daemon/service/stop_signals.hpp"

namespace splid {

// Reads the configuration anew on SIGHUP and says, in the log and in the status, what came of it.
// A refusal, or the need of a restart, stays in the status until the next reload.
//
// Threads: made and destroyed on one thread; reloads on a thread of its own, so that a signal to
// stop is heard meanwhile. Errors: none.
class Reloader {
 public:
  // Takes over what can change while frames flow. is_new: the configuration differs in that from
  // the configuration in use. Returns a sentence on what else was taken over, or nothing. Errors:
  // Error where the configuration is refused; nothing has changed then.
  using Apply = std::function<std::string(const std::shared_ptr<const Config>&, bool is_new)>;

  // original, device and signals outlive this. signals: whose hangup means a reload; null: there is
  // none. The end waits for a reload that is under way, which `apply` should end soon after a stop.
  Reloader(const Config& original, DeviceMonitor& device, StopSignals* signals, Apply apply);
  ~Reloader();
  Reloader(const Reloader&) = delete;
  Reloader& operator=(const Reloader&) = delete;

 private:
  void run(const std::stop_token& stop);
  void reload();
  void refuse(const std::string& sentence);

  const Config& original_;
  DeviceMonitor& device_;
  StopSignals* signals_;
  Apply apply_;
  std::shared_ptr<const Config> in_use_;  // null: the original
  // The allow-lists that are in use: one that was taken away is, until the restart.
  std::string readers_;
  std::string controllers_;
  ServiceNotifier notifier_{host_clock()};
  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool asked_ = false;  // guarded by mutex_
  std::jthread thread_;
};

}  // namespace splid
