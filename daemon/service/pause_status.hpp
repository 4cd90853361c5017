#pragma once

#include <cstdint>
#include <string>

#include "daemon/base/clock.hpp"
#include "daemon/output/device_monitor.hpp"
#include "daemon/output/metrics.hpp"
#include "daemon/output/publisher.hpp"
#include "daemon/output/service_notifier.hpp"
#include "daemon/pipeline/pipeline.hpp"

namespace splid {

// Speaks for the daemon while it does not measure: `waiting_for_device`, with the reason, once a
// second and on every change, a fed watchdog and metrics that stand still.
//
// Design note: the states are a closed list that programs switch over, and to them a daemon without
// stream is one that waits for its instrument, whoever took that away; who wants to know reads the
// reason.
//
// Threads: one. Errors: none.
class PauseStatus {
 public:
  // All outlive this; metrics: null where there are none. live: timestamps are the host's.
  PauseStatus(Publisher& publisher, DeviceMonitor& device, ServiceNotifier& notifier,
              Metrics* metrics, const Clock& clock, bool live)
      : publisher_(publisher),
        device_(device),
        notifier_(notifier),
        metrics_(metrics),
        clock_(clock),
        live_(live) {}

  // At least every 100 ms. so_far: its status is the one that goes on. reason: a sentence.
  void tick(StreamSoFar& so_far, const std::string& reason);
  // The daemon ends without measuring again.
  void stop(StreamSoFar& so_far);

 private:
  void publish(StatusMessage& status);

  Publisher& publisher_;
  DeviceMonitor& device_;
  ServiceNotifier& notifier_;
  Metrics* metrics_;
  const Clock& clock_;
  bool live_;
  std::string notice_;  // for a second
  std::int64_t next_ns_ = 0;
};

}  // namespace splid
