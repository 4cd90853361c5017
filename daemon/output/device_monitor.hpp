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
// Threads: report(), notice() and the configuration's fault any, the others one. Locks; never on
// the way of a tag. Errors: none.
class DeviceMonitor {
 public:
  void report(const DeviceReport& report) { put(reports_, report); }
  // What a source is given to report to; outlived by this.
  auto hears() {
    return [this](const DeviceReport& each) { report(each); };
  }
  // One sentence on something that is over, such as a configuration that was not reloaded.
  void notice(const std::string& sentence) { put(notices_, sentence); }

  // What holds until it is set anew, such as why the configuration's file is not in use; a
  // sentence, or nothing.
  void set_configuration_fault(const std::string& sentence) {
    const std::scoped_lock lock(mutex_);
    configuration_fault_ = sentence;
    if (wake_ != nullptr) wake_->notify();
  }
  [[nodiscard]] std::string configuration_fault() const {
    const std::scoped_lock lock(mutex_);
    return configuration_fault_;
  }

  // Who sleeps until something comes; null: nobody. It outlives this, or is taken back.
  void set_wake(Wake* wake) {
    const std::scoped_lock lock(mutex_);
    wake_ = wake;
  }

  // What came since the last call, in order, the last 64 of it.
  std::vector<DeviceReport> take_reports() { return take(reports_); }
  std::vector<std::string> take_notices() { return take(notices_); }

 private:
  static constexpr std::size_t max_pending = 64;

  template <class Item>
  void put(std::vector<Item>& items, const Item& item) {
    const std::scoped_lock lock(mutex_);
    // Of an instrument that flaps faster than it is looked at, what came last.
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
