#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "daemon/base/clock.hpp"
#include "daemon/output/publisher.hpp"
#include "drivers/source.hpp"
#include "estimator/model/options.hpp"
#include "protocol/messages.hpp"

namespace splid {

// What a stream is like at a moment.
struct StreamHealth {
  std::uint64_t tags = 0;                         // taken from the source
  std::int64_t last_arrival_ns = 0;               // of a tag or heartbeat; 0: none yet
  double ring_fill_ratio = 0;                     // highest since the last call
  std::string sync_fault;                         // a sentence; empty: none
  std::vector<DeviceReport> device_reports = {};  // since the last call, in order
  std::vector<std::string> notices = {};          // likewise: sentences on other things
  std::string recording_fault = {};               // a sentence; empty: none
  // A configuration that was not taken over: a sentence that holds until the next one; empty: none.
  std::string configuration_fault = {};
};

// Publishes `version` once and `status` once a second, on every change of state or reason, and for
// each thing that the driver reports of its instrument or that is noticed elsewhere; what is over
// is repeated for a second, what lasts is added to the reason as long as it lasts.
//
// States: starting until the first frame; waiting_for_device while the driver says no_device or a
// live source has been silent for four frames; degraded while the driver says failing or the last
// frame was no_sync, incomplete or saturated, or the photons of half of a second's frames with
// light in them contradict the pattern, or live frames have less effort than configured or take
// longer to compute than they last, or nothing is recorded that should be; stopping from stop() on.
//
// Threads: one. Errors: none.
class StatusReporter {
 public:
  // publisher, clock: outlive this.
  StatusReporter(const Config& config, const SourceInfo& source, Publisher& publisher,
                 const Clock& clock);

  void start();
  // Counts and the messages' sequence go on from those of an earlier stream. Before start().
  void go_on_from(const StatusMessage& before);
  void frame_published(const FrameMessage& message);
  // To be called at least every 100 ms.
  void tick(const StreamHealth& health);
  // The stream is over. reason: why, empty where nothing is wrong.
  void stop(const StreamHealth& health, const std::string& reason);
  // The effort that frames are to have; with less the daemon is degraded.
  void configure(Effort effort) { configured_effort_ = to_string(effort); }

  // The last frame had less effort than was configured.
  [[nodiscard]] bool effort_is_lowered() const {
    return !last_effort_.empty() && last_effort_ != configured_effort_;
  }
  // As last judged.
  [[nodiscard]] const StatusMessage& status() const { return status_; }

 private:
  void judge(const StreamHealth& health);
  void add_reason(const std::string& sentence);
  void judge_device(const StreamHealth& health);
  void judge_second();
  void disturb();
  [[nodiscard]] bool is_disturbed_frame() const;
  void judge_cost();
  void judge_stream(const StreamHealth& health);
  void publish(const StreamHealth& health);
  [[nodiscard]] double timestamp_s() const;

  SourceInfo source_;
  Publisher& publisher_;
  const Clock& clock_;
  VersionMessage version_;
  StatusMessage status_;
  DeviceReport device_;
  std::string notice_;
  FrameStatus last_frame_ = FrameStatus::not_run;
  // Until then the instrument was away, or has only just come back, and no frame has been whole
  // since: what frames lack is its absence.
  std::int64_t disturbed_until_ns_ = 0;
  std::string configured_effort_;
  std::string last_effort_;
  int frames_this_second_ = 0;   // with a target
  int misfits_this_second_ = 0;  // of these, with other amplitudes than the pattern's
  double amplitude_misfit_ = 0;  // of the last such
  int unsure_this_second_ = 0;   // of these, ambiguous by their photons and not by the mode
  int faults_this_second_ = 0;   // without a target, since the photons contradict the pattern
  PatternFault pattern_fault_ = PatternFault::none;  // of the last such
  double computed_ms_ = 0, lasted_ms_ = 0;           // this second's frames together
  double threads_ = 1;                               // that share the frames
  std::string frames_reason_;                        // of the second before
  std::string pattern_reason_, cost_reason_;         // likewise
  double last_frame_s_ = 0;
  double silence_limit_ns_;
  std::int64_t started_ns_ = 0;
  std::int64_t next_ns_ = 0;
  double highest_fill_ = 0;
};

}  // namespace splid
