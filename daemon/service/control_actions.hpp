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
// Threads: status() may be called from any thread and returns at once; perform() is called from one
// thread. Errors: both throw Error, which becomes the reply, with the fault that the command of the
// same name would exit with.
class ControlActions {
 public:
  // config, measuring and publisher outlive the actions.
  ControlActions(const Config& config, Measuring& measuring, const Publisher& publisher)
      : config_(config), measuring_(measuring), publisher_(publisher) {}

  // doing: names the action that runs; empty where none runs.
  control::Reply status(const std::string& doing);
  // Does what is asked; any request but `status`.
  control::Reply perform(const control::Request& request, const std::stop_token& stop);

 private:
  control::Reply start(const std::stop_token& stop);
  control::Reply stop(const std::stop_token& stop);
  control::Reply record(const std::stop_token& stop);
  control::Reply end_recording();
  control::Reply upload_pattern(const std::stop_token& stop);
  control::Reply calibrate(const control::CalibrateRequest& request, const std::stop_token& stop);
  control::Reply calibrate_from_source(const control::CalibrateRequest& request,
                                       const std::stop_token& stop);
  std::string go_on(bool measured, const std::stop_token& stop);
  void show_progress(const std::string& text);

  const Config& config_;
  Measuring& measuring_;
  const Publisher& publisher_;
  std::mutex mutex_;
  std::string progress_;  // of the action that runs; under the mutex
};

}  // namespace splid
