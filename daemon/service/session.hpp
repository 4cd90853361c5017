#pragma once

#include <memory>
#include <stop_token>
#include <string>

#include "config/config.hpp"
#include "daemon/output/device_monitor.hpp"
#include "daemon/service/stop_signals.hpp"
#include "drivers/source.hpp"

namespace splid::recording {
class FrameLog;
}  // namespace splid::recording

namespace splid {

// The room daemon/service is the life of a run. Read this header first, then measuring.hpp (streams
// that begin and end), control_actions.hpp (what a client may ask) and start_check.hpp (what is
// checked before the first tag).

// What `run` and `replay` share.

struct SessionOptions {
  bool json = false;    // each frame on standard output too
  bool publish = true;  // false: binds no endpoint
  // Where another program has the endpoint, frames are printed alone; see open_publisher().
  bool may_only_print = false;
  // What to do to publish elsewhere, for the error where another program has the endpoint; empty:
  // the configuration is to name another.
  std::string other_endpoint;
  // How many messages are kept for a subscriber that does not read: some seconds of them.
  int queue_messages = 1000;
  double wait_for_subscriber_s = 0;  // before the stream starts, at most
  bool is_service = false;           // records and can be controlled, as the configuration says
  recording::FrameLog* frames = nullptr;  // of a replay: takes each frame too; may be null
  StopSignals* signals = nullptr;         // whose SIGHUP reloads the configuration; may be null
};

// Measures from the source to the subscribers, and returns the exit code. The log says what is done
// and at the end what came of it, with the RMSE against an encoder where there is one. A control
// request may end a stream and begin another; see Measuring. A fault of options.frames ends the
// stream.
//
// Errors: Error of start-up; of the source, after all frames were published; Fault::data where no
// frame could lock although syncs came, or photons contradict the pattern, and no stop was
// requested.
int run_session(const Config& config, std::unique_ptr<TagSource> source, DeviceMonitor& device,
                const SessionOptions& options, const std::stop_token& stop);

}  // namespace splid
