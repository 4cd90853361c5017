#include "daemon/service/pause_status.hpp"

#include <utility>

namespace splid {
namespace {

constexpr std::int64_t ns_per_s = 1'000'000'000;

}  // namespace

void PauseStatus::tick(StreamSoFar& so_far, const std::string& reason) {
  for (const std::string& notice : device_.take_notices()) notice_ = notice;
  StatusMessage& status = so_far.status;
  const bool due = clock_.steady_ns() >= next_ns_;
  std::string said = notice_.empty() ? reason : reason + "; " + notice_;
  const std::string fault = device_.configuration_fault();
  if (!fault.empty()) said += "; " + fault;
  if (due || status.state != DaemonState::waiting_for_device || status.reason != said) {
    status.state = DaemonState::waiting_for_device;
    status.reason = said;
    status.device_name.clear();  // nothing is open
    publish(status);
  }
  if (due) notice_.clear();
  notifier_.tick(status, true);
  if (metrics_ != nullptr && metrics_->due()) {
    metrics_->refresh(status, so_far.totals, so_far.counters);
  }
}

void PauseStatus::stop(StreamSoFar& so_far) {
  so_far.status.state = DaemonState::stopping;
  so_far.status.reason.clear();
  publish(so_far.status);
  notifier_.tick(so_far.status, true);
}

void PauseStatus::publish(StatusMessage& status) {
  if (live_) status.timestamp_s = clock_.unix_s();
  status.ring_fill_ratio = 0;
  publisher_.publish_status(to_json(status));
  ++status.sequence;
  next_ns_ = clock_.steady_ns() + ns_per_s;
}

}  // namespace splid
