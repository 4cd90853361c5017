#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/output/last_second.hpp"
#include "daemon/output/publisher.hpp"
#include "drivers/source.hpp"
#include "estimator/model/options.hpp"
#include "protocol/frame_json.hpp"
#include "protocol/status_json.hpp"

namespace splid {

// What a stream is like at a moment.
struct StreamHealth {
  std::uint64_t tags = 0;                         // taken from the source
  std::int64_t last_arrival_ns = 0;               // of a tag or heartbeat; 0: none yet
  double ring_fill_ratio = 0;                     // highest since the last call
  std::string sync_fault;                         // a sentence; empty: none
  std::vector<DeviceReport> device_reports = {};  // since the last call, in order
  std::vector<std::string> notices = {};          // sentences since the last call, in order
  std::string recording_fault = {};               // a sentence; empty: none
  std::string scan_fault = {};                    // a sentence; empty: none
  // Why a configuration was not taken over, in a sentence that holds until the next reload; empty:
  // it was.
  std::string configuration_fault = {};
  std::optional<RecordingStatus> recording = {};  // absent: nothing is to be recorded
  bool clock_is_at_its_end = false;               // tags come beyond the range of times
  bool ring_is_empty = true;                      // else what comes waits, which is no silence
};

// What the status needs to know of the configuration.
struct StatusOptions {
  std::string source_driver;
  std::string pattern_file;
  Mode mode = Mode::baseline;
  Effort effort = Effort::balanced;  // that frames are to have
  double frame_length_ms = 50;
  double estimation_threads = 1;  // that share the frames
  double mean_amplitude = 1;      // of the pattern's pulses
  // What leaves a dead time out that is to be modelled, as unmodelled_by() has it; empty: nothing.
  std::string dead_time_left_out_by = {};
  bool models_dead_time = false;  // one is given, and nothing leaves it out
  std::size_t ring_capacity = 0;  // tags
};

StatusOptions status_options(const Config& config);

// Publishes `version` once and `status` once a second, on every change of state or reason, when a
// recording begins, ends, fails or goes on in another file, and for each report of the driver on
// its instrument and each notice from elsewhere. An event that is over is repeated for a second; a
// condition is part of the reason as long as it lasts.
//
// States: starting until the first frame; waiting_for_device while the driver says no_device or a
// live source has been silent for four frames; degraded while the driver says failing or the last
// frame was no_sync, incomplete or saturated, or the photons of most frames of a second
// contradict the pattern, or live frames have less effort than configured or take
// longer to compute than they last, or nothing is recorded that should be; stopping from stop() on.
//
// Threads: one. Errors: none.
class StatusReporter {
 public:
  // publisher, clock: outlive this.
  StatusReporter(const StatusOptions& options, Publisher& publisher, const Clock& clock);

  // A stream begins: what its frames and its driver say is judged afresh, and the counts and the
  // messages' sequence go on.
  void begin(const SourceInfo& source);
  // recent: what this frame and those before it show together. is_cut_off: the stream ended before
  // the frame did, so that what the frame lacks is no fault.
  void frame_published(const FrameMessage& message,
                       const std::vector<FrameMessage::Finding>& recent = {},
                       bool is_cut_off = false);
  // What the pixels do, where there are several.
  void pixels_seen(const StatusMessage::Pixels& pixels) { status_.pixels = pixels; }
  // To be called at least every 100 ms.
  void tick(const StreamHealth& health);
  // There is no stream: subscribers hear that the daemon waits for its device, and why. To be
  // called at least every 100 ms. reason: a sentence; of `health` tags, notices and
  // configuration_fault are looked at.
  //
  // Design note: the states are a closed list that programs switch over, and to them a daemon
  // without stream is a daemon that waits for its instrument, whoever took the instrument away; the
  // reason tells people more.
  void wait(const StreamHealth& health, const std::string& reason);
  // The run is over. reason: why, empty where nothing is wrong.
  void stop(const StreamHealth& health, const std::string& reason);
  // A reload: the effort that frames are to have, with less than which the daemon is degraded, and
  // whether the dead time is modelled.
  void configure(const StatusOptions& options) {
    configured_effort_ = to_string(options.effort);
    dead_time_left_out_by_ = options.dead_time_left_out_by;
    models_dead_time_ = options.models_dead_time;
    mean_amplitude_ = options.mean_amplitude;
  }

  // The last frame had less effort than was configured.
  [[nodiscard]] bool effort_is_lowered() const {
    return !stream_.last_effort.empty() && stream_.last_effort != configured_effort_;
  }
  // The ring that the last frame would have needed; 0: it had room for its photons.
  [[nodiscard]] std::uint64_t ring_needed() const { return stream_.ring_needed; }
  // The status as it was last judged.
  [[nodiscard]] const StatusMessage& status() const { return status_; }

 private:
  void judge(const StreamHealth& health);
  void add_reason(const std::string& sentence);
  void note(const std::string& notice);
  void judge_device(const StreamHealth& health);
  void disturb();
  [[nodiscard]] bool is_disturbed_frame() const;
  [[nodiscard]] std::string reason_of_frame(FrameStatus status, const StreamHealth& health) const;
  [[nodiscard]] std::string reason_of_measurement(const StreamHealth& health) const;
  void judge_stream(const StreamHealth& health);
  void judge_frames(const StreamHealth& health);
  [[nodiscard]] bool is_turned(const StreamHealth& health) const;
  void publish(const StreamHealth& health);
  [[nodiscard]] double timestamp_s() const;

  // What is known of the stream that runs.
  struct StreamSeen {
    SourceInfo source;
    DeviceReport device;
    std::int64_t report_ends_ns = 0;  // it has been published for a second then
    std::string notice;
    std::int64_t notice_ends_ns = 0;
    FrameStatus last_frame = FrameStatus::not_run;
    std::uint64_t ring_needed = 0;  // that frame: see ring_needed()
    // Of the last frame that was saturated.
    bool knew_dead_time = false;   // the dead time was modelled
    bool is_beyond_model = false;  // there was more light than that is for
    // Until then the instrument was away, or has only just come back, and no frame has been whole
    // since: what frames lack is due to its absence.
    std::int64_t disturbed_until_ns = 0;
    std::string last_effort;
    double last_frame_s = 0;
    std::int64_t started_ns = 0;
    // The longest time between frames in which the instrument was there and sent, and the begin of
    // such a time.
    std::int64_t longest_gap_ns = 0;
    std::int64_t gap_begin_ns = 0;
  };

  Publisher& publisher_;
  const Clock& clock_;
  VersionMessage version_;
  StatusMessage status_;
  bool waits_ = false;  // there is no stream
  StreamSeen stream_;
  LastSecond second_;
  std::string configured_effort_;
  std::string dead_time_left_out_by_;
  bool models_dead_time_ = false;
  std::size_t ring_capacity_;
  double mean_amplitude_ = 1;
  double silence_limit_ns_;
  std::int64_t next_ns_ = 0;         // a status is due
  std::int64_t second_ends_ns_ = 0;  // of frames that are judged together
  double highest_fill_ = 0;
};

}  // namespace splid
