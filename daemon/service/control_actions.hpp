#pragma once

#include <mutex>
#include <stop_token>
#include <string>

#include "config/config.hpp"
#include "daemon/output/publisher.hpp"
#include "daemon/service/control/control_message.hpp"
#include "daemon/service/measuring.hpp"

namespace splid {

// What the daemon does when it is asked; docs/reference/control.md has the replies.
//
// Threads: status() any, at once; perform() one. Errors: both throw Error, which is the reply; its
// fault is that of the command of the same name.
class ControlActions {
 public:
  // All outlive this.
  ControlActions(const Config& config, Measuring& measuring, const Publisher& publisher)
      : config_(config), measuring_(measuring), publisher_(publisher) {}

  // doing: the action that runs; empty: none.
  ControlReply status(const std::string& doing);
  // Not status.
  ControlReply perform(const ControlRequest& request, const std::stop_token& stop);

 private:
  ControlReply start(const std::stop_token& stop);
  ControlReply stop(const std::stop_token& stop);
  ControlReply record(const std::stop_token& stop);
  ControlReply end_recording();
  ControlReply upload_pattern(const std::stop_token& stop);
  ControlReply calibrate(const CalibrateRequest& request, const std::stop_token& stop);
  ControlReply calibrate_from_source(const CalibrateRequest& request, const std::stop_token& stop);
  std::string go_on(bool measured, const std::stop_token& stop);
  void show_progress(const std::string& text);

  const Config& config_;
  Measuring& measuring_;
  const Publisher& publisher_;
  std::mutex mutex_;
  std::string progress_;  // of the action that runs; under the mutex
};

}  // namespace splid
