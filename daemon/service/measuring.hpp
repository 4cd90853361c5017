#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "config/config.hpp"
#include "daemon/output/device_monitor.hpp"
#include "daemon/output/output.hpp"
#include "daemon/recording/recording_tap.hpp"
#include "daemon/stream/stream.hpp"
#include "drivers/source.hpp"
#include "protocol/error.hpp"

namespace splid {

// Measures one stream after the other from the configured source, to the same output. Between two
// streams the source is closed, and another program may use the instrument.
//
// Threads: run() is called on one thread, the other functions on any other threads, one at a time,
// while run() runs or before it.
class Measuring {
 public:
  // config, output and device outlive this. may_record: tags are kept as config.record says; false:
  // never.
  Measuring(const Config& config, Output& output, DeviceMonitor& device, bool may_record);

  // Measures from `source` and, after a pause() and a start(), from the configured source opened
  // anew, until a stream ends by itself or fails or a stop is requested. Returns what came of the
  // last stream. Errors: Error where the first stream cannot start; what the output's observer
  // throws.
  StreamSummary run(std::unique_ptr<TagSource> source, const std::stop_token& stop);

  // Opens the source and measures; returns false where that is so already. Errors: what keeps the
  // source from opening, after which the status goes on to say so; Error(Fault::usage) after a stop
  // request.
  bool start(const std::stop_token& stop);
  // Publishes what has come and closes the source, which takes 500 ms at most; returns false where
  // the source was closed already. reason: what the status says meanwhile, never empty. Errors:
  // Error(Fault::usage) after a stop request.
  bool pause(const std::string& reason, const std::stop_token& stop);

  // Frames from now on follow what is live (reload.hpp) of this configuration, those of the next
  // stream where there is none. Errors: those of Stream::Make, which a stop request ends; all goes
  // on as before then.
  void reload(const Config& given, const std::stop_token& stop);

  // Records what is measured from now on, in this stream and the next; returns false where a
  // recording runs already.
  // Errors: Error(Fault::usage) where the configuration has no folder.
  bool record();
  // Ends the recording; returns false where there was none. Waits for the disk, 2 s at most.
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
  void hurry();
  void give_up(Fault fault, const std::string& sentence);
  void record(Stream& stream);
  void finish_recording();

  const Config& config_;
  Output& output_;
  DeviceMonitor& device_;

  // Whoever takes both mutexes takes recording_mutex_ first. It is held while a recording is made
  // or ended, which may take seconds; records() and the like do not wait for it.
  std::mutex recording_mutex_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  // Under the mutex; the stream and what concerns the recording change under both mutexes and may
  // be read under either.
  bool wanted_ = true;
  bool over_ = false;   // run() has returned
  std::string reason_;  // why it is not to measure
  // The reason that the status gives while the source is closed; empty while the source is open.
  std::string waits_for_;
  // Of the last attempt to measure again, which reason_ tells.
  std::optional<Fault> failure_;
  std::optional<Config> reloaded_;
  std::unique_ptr<Stream> stream_;  // null: there is none
  std::uint64_t streams_ = 0;       // that have begun
  bool pausing_ = false;            // pause() has asked the stream to end
  bool to_record_;
  std::unique_ptr<recording::Tap> recording_;
  std::string recording_file_;  // of a recording that has ended
};

}  // namespace splid
