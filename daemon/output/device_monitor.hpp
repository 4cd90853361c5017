#pragma once

#include <cstddef>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "drivers/wake.hpp"
#include "protocol/device_report.hpp"

namespace splid {

// Carries what a driver says of its instrument, and what else subscribers should hear of, to the
// publishing thread.
//
// Threads: report(), notice() and set_configuration_fault() may be called from any thread, the
// other functions from one. Each call locks; none is on the way of a tag. Errors: none.
class DeviceMonitor {
 public:
  void report(const DeviceReport& report) { put(reports_, report); }
  // What a source is given to report to. The monitor outlives the source.
  auto hears() {
    return [this](const DeviceReport& each) { report(each); };
  }
  // Takes one sentence on an event that is over, such as a configuration that was not reloaded.
  void notice(const std::string& sentence) { put(notices_, sentence); }

  // Takes a sentence that holds until the next call, such as why the configuration's file is not in
  // use; an empty sentence says that all is well.
  void set_configuration_fault(const std::string& sentence) {
    const std::scoped_lock lock(mutex_);
    configuration_fault_ = sentence;
    if (wake_ != nullptr) wake_->notify();
  }
  [[nodiscard]] std::string configuration_fault() const {
    const std::scoped_lock lock(mutex_);
    return configuration_fault_;
  }

  // Takes what wakes the publishing thread when something comes; null: nothing is woken. The caller
  // sets null before the wake is gone.
  void set_wake(Wake* wake) {
    const std::scoped_lock lock(mutex_);
    wake_ = wake;
  }

  // The reports, or notices, that came since the last call, in order; of more than 64 the last 64.
  std::vector<DeviceReport> take_reports() { return take(reports_); }
  std::vector<std::string> take_notices() { return take(notices_); }

 private:
  static constexpr std::size_t max_pending = 64;

  template <class Item>
  void put(std::vector<Item>& items, const Item& item) {
    const std::scoped_lock lock(mutex_);
    // An instrument may flap faster than its reports are taken: the last reports are kept.
    if (items.size() == max_pending) items.erase(items.begin());
    items.push_back(item);
    if (wake_ != nullptr) wake_->notify();
  }
  template <class Item>
  std::vector<Item> take(std::vector<Item>& items) {
    const std::scoped_lock lock(mutex_);
    return std::exchange(items, {});
  }

  mutable std::mutex mutex_;
  Wake* wake_ = nullptr;
  std::vector<DeviceReport> reports_;
  std::vector<std::string> notices_;
  std::string configuration_fault_;
};

}  // namespace splid
