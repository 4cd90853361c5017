#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>

#include "config/config.hpp"
#include "daemon/output/device_monitor.hpp"
#include "daemon/output/output.hpp"
#include "daemon/recording/recording_tap.hpp"
#include "daemon/stream/stream.hpp"
#include "drivers/source.hpp"

namespace splid {

// One stream after the other from the configured source, to the same subscribers: in between the
// source is closed, and another program may use the instrument. Frames are numbered, and everything
// is counted, as if there were one stream.
//
// Threads: run() on one; the rest on any others, one at a time, while run() runs or before it.
class Measuring {
 public:
  // All outlive this. may_record: as config.record says.
  Measuring(const Config& config, Output& output, DeviceMonitor& device, bool may_record);

  // Measures from `source`, and from others of its kind as start() and pause() have it, until a
  // stream ends by itself or fails, or a stop is requested. Returns what the last one came to.
  // Errors: Error of start-up; those of the observer.
  StreamSummary run(std::unique_ptr<TagSource> source, const std::stop_token& stop);

  // Opens the source and measures; false where it does already. Errors: what keeps it from
  // measuring; it goes on waiting then, and says why. Error(Fault::usage) after a stop request.
  bool start(const std::stop_token& stop);
  // Publishes what has come and closes the source, which takes 500 ms at most; false where that is
  // so already. reason: what status says meanwhile, never empty. Errors: Error(Fault::usage) after
  // a stop request.
  bool pause(const std::string& reason, const std::stop_token& stop);

  // Frames from now on are estimated as this configuration says: see Stream::reload and
  // Output::reload.
  void reload(std::shared_ptr<const Config> next);

  // Records what is measured from now on, in this stream and the next; false where it does already.
  // Errors: Error(Fault::usage) where the configuration has no folder.
  bool record();
  // Ends it; false where nothing was to be recorded. Waits for the disk.
  bool end_recording();
  // The file that is being written, or was written last; empty: none.
  [[nodiscard]] std::string recording_file() const;
  [[nodiscard]] bool records() const;

  [[nodiscard]] bool measures() const;

 private:
  void prepare(std::unique_ptr<TagSource> source);
  StreamSummary measure(const std::stop_token& stop);
  bool wait_until_wanted(const std::stop_token& stop);
  bool resume();
  void record(Stream& stream);
  void finish_recording();

  const Config& config_;
  Output& output_;
  DeviceMonitor& device_;

  // Whoever takes both mutexes takes this one first. It is held while a recording is made or ended,
  // which may take seconds; records() and the like do not wait for it.
  std::mutex recording_mutex_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  // Under the mutex; the stream and what concerns the recording change under both mutexes and may
  // be read under either.
  bool wanted_ = true;
  bool over_ = false;   // run() has returned
  std::string reason_;  // why it is not to measure
  // The reason that status gives while the source is closed; empty: it is open.
  std::string waits_for_;
  std::exception_ptr failure_;  // of the last attempt to measure again
  std::shared_ptr<const Config> reloaded_;
  std::unique_ptr<Stream> stream_;  // null: there is none
  bool pausing_ = false;            // pause() ended the stream
  bool to_record_;
  std::unique_ptr<RecordingTap> recording_;
  std::string recording_file_;  // of a recording that has ended
};

}  // namespace splid
