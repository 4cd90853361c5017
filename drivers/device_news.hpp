#pragma once

#include <functional>
#include <optional>
#include <utility>

#include "protocol/device_report.hpp"

namespace splid {

// Passes an instrument's reports on. What holds is reported once. An event, told with the state
// connected and a reason, is reported each time.
//
// Threads: one. Errors: none.
class DeviceNews {
 public:
  using Report = std::function<void(const DeviceReport&)>;

  explicit DeviceNews(Report report) : report_(std::move(report)) {}

  void say(const DeviceReport& said) {
    const bool is_event = said.state == DeviceState::connected && !said.reason.empty();
    if (!is_event && holds_ == said) return;
    holds_ = said;
    if (is_event) holds_->reason.clear();
    report_(said);
  }

 private:
  Report report_;
  std::optional<DeviceReport> holds_;
};

}  // namespace splid
