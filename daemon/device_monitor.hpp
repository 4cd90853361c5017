#pragma once

#include <mutex>
#include <utility>
#include <vector>

#include "protocol/device_report.hpp"

namespace splid {

// Carries what a driver says of its instrument to the publishing thread.
//
// Threads: report() any, take() one. Locks; never on the way of a tag. Errors: none.
class DeviceMonitor {
 public:
  void report(const DeviceReport& report) {
    const std::scoped_lock lock(mutex_);
    // Of an instrument that flaps faster than it is looked at, what came last.
    if (pending_.size() == max_pending) pending_.erase(pending_.begin());
    pending_.push_back(report);
  }

  // What was reported since the last call, in order, the last 64 of it.
  std::vector<DeviceReport> take() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(pending_, {});
  }

 private:
  static constexpr std::size_t max_pending = 64;

  std::mutex mutex_;
  std::vector<DeviceReport> pending_;
};

}  // namespace splid
