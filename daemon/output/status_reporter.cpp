#include "daemon/output/status_reporter.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <utility>

#include "daemon/base/text.hpp"
#include "daemon/output/pixel_watch.hpp"
#include "daemon/stream/frame_message.hpp"
#include "daemon/stream/frame_plan.hpp"

namespace splid {
namespace {

constexpr std::int64_t ns_per_s = 1'000'000'000;
constexpr double ns_per_ms = 1e6;

// A live source without a tag for this many frames is silent: a heartbeat is due every 10 ms.
constexpr double silent_frames = 4;

const char* reason_of(FrameStatus status) {
  switch (status) {
    case FrameStatus::no_sync:
      return "the last frame had too few pattern syncs: look at channels.sync and its cable";
    case FrameStatus::incomplete:
      return "tags are being lost: the last frame saw less than frame.min_seen_fraction";
    case FrameStatus::saturated:
      return "so much light that the detector's dead time biases the values: attenuate it "
             "(detector.dead_time modelled holds up to 10 detections in a dead time or a pulse)";
    default:
      return nullptr;
  }
}

}  // namespace

StatusOptions status_options(const Config& config) {
  return {config.source_driver,
          config.pattern_file,
          config.pattern.mode,
          config.estimator.effort,
          config.frame.length_ms,
          static_cast<double>(config.pipeline.estimation_threads),
          mean_amplitude(config.pattern),
          unmodelled_by(config),
          config.detector.dead_time_ns > 0 && config.detector.dead_time == DeadTime::modelled &&
              unmodelled_by(config).empty(),
          std::bit_ceil(static_cast<std::size_t>(config.pipeline.ring_capacity_tags))};
}

StatusReporter::StatusReporter(const StatusOptions& options, Publisher& publisher,
                               const Clock& clock)
    : publisher_(publisher),
      clock_(clock),
      second_(options.estimation_threads),
      ring_capacity_(options.ring_capacity),
      silence_limit_ns_(std::max(silent_frames * options.frame_length_ms, 100.0) * ns_per_ms) {
  version_.release = SPLID_VERSION;
  version_.pattern = std::filesystem::path(options.pattern_file).stem().string();
  version_.mode = options.mode;
  status_.source = options.source_driver;
  configure(options);
}

void StatusReporter::begin(const SourceInfo& source) {
  waits_ = false;
  stream_ = {};
  second_.begin();
  stream_.source = source;
  stream_.last_frame_s = source.start_unix_s.value_or(0);
  stream_.started_ns = clock_.steady_ns();
  stream_.gap_begin_ns = stream_.started_ns;
  second_ends_ns_ = stream_.started_ns + ns_per_s;
  status_.state = DaemonState::starting;
  status_.reason = second_.why();
  status_.device = DeviceState::connected;
  status_.device_name.clear();
  version_.timestamp_s = timestamp_s();
  publisher_.publish_version(to_json(version_));
  StreamHealth health;
  health.tags = status_.tags;
  publish(health);
}

void StatusReporter::frame_published(const FrameMessage& message,
                                     const std::vector<FrameMessage::Finding>& recent,
                                     bool is_cut_off) {
  const bool is_judged = message.valid() || !is_cut_off;
  const std::int64_t now_ns = clock_.steady_ns();
  stream_.longest_gap_ns = std::max(stream_.longest_gap_ns, now_ns - stream_.gap_begin_ns);
  stream_.gap_begin_ns = now_ns;
  ++status_.frames;
  if (message.valid()) ++status_.valid_frames;
  status_.lost_tags += message.lost_tags.value_or(0);
  status_.uncounted_losses += message.uncounted_losses;
  if (is_judged) stream_.last_frame = message.status;
  stream_.ring_needed =
      splid::ring_needed(message.photons.value_or(0), message.lost_tags.value_or(0),
                         most_photons(ring_capacity_, stream_.source.live));
  if (message.status == FrameStatus::saturated) {
    stream_.knew_dead_time = message.blind_fraction.has_value();
    stream_.is_beyond_model =
        message.blind_fraction &&
        is_beyond_model(*message.blind_fraction,
                        message.signal_per_pulse.value_or(0) * mean_amplitude_);
  }
  if (!is_disturbed_frame()) stream_.disturbed_until_ns = 0;
  if (is_judged) second_.add(message, recent);
  stream_.last_effort = message.effort.value_or(configured_effort_);
  stream_.last_frame_s = message.timestamp_s;
}

void StatusReporter::tick(const StreamHealth& health) {
  second_.look();
  highest_fill_ = std::max(highest_fill_, health.ring_fill_ratio);
  for (const DeviceReport& report : health.device_reports) {
    stream_.device = report;
    stream_.report_ends_ns = clock_.steady_ns() + ns_per_s;
    judge(health);
    publish(health);
  }
  for (const std::string& notice : health.notices) {
    note(notice);
    judge(health);
    publish(health);
  }
  const std::int64_t now_ns = clock_.steady_ns();
  // Frames may last longer than a second, and so may the line of a scan, which they come after.
  const double waits_ns =
      second_.has_frames()
          ? 0
          : std::max(silence_limit_ns_, static_cast<double>(stream_.longest_gap_ns));
  if (static_cast<double>(now_ns - second_ends_ns_) >= waits_ns) {
    second_.end();
    second_ends_ns_ = now_ns + ns_per_s;
  }
  const StatusMessage before = status_;
  judge(health);
  const bool is_new = before.state != status_.state || before.reason != status_.reason ||
                      before.measurement != status_.measurement || is_turned(health);
  if (now_ns >= next_ns_ || is_new) publish(health);
  // Notices, and the reasons of faults that are over, have now been published for a second.
  if (now_ns >= stream_.notice_ends_ns) stream_.notice.clear();
  if (now_ns >= stream_.report_ends_ns && stream_.device.state == DeviceState::connected) {
    stream_.device.reason.clear();
  }
}

void StatusReporter::note(const std::string& notice) {
  stream_.notice = notice;
  stream_.notice_ends_ns = clock_.steady_ns() + ns_per_s;
}

void StatusReporter::wait(const StreamHealth& health, const std::string& reason) {
  if (!std::exchange(waits_, true)) {
    stream_.notice.clear();
    second_.begin();
  }
  for (const std::string& notice : health.notices) note(notice);
  const std::string said = std::exchange(status_.reason, reason);
  add_reason(stream_.notice);
  add_reason(health.configuration_fault);
  const bool is_new = status_.state != DaemonState::waiting_for_device || status_.reason != said;
  status_.state = DaemonState::waiting_for_device;
  status_.device_name.clear();  // no instrument is open
  highest_fill_ = 0;
  const std::int64_t now_ns = clock_.steady_ns();
  if (now_ns >= next_ns_ || is_new) publish(health);
  if (now_ns >= stream_.notice_ends_ns) stream_.notice.clear();
}

void StatusReporter::stop(const StreamHealth& health, const std::string& reason) {
  highest_fill_ = std::max(highest_fill_, health.ring_fill_ratio);
  status_.state = DaemonState::stopping;
  status_.reason = reason;
  // Of a stream that is over within its first second no second has been judged yet.
  if (second_.has_frames()) second_.end();
  if (second_.contradicts_pattern()) add_reason(second_.why());
  publish(health);
}

void StatusReporter::judge(const StreamHealth& health) {
  judge_device(health);
  const bool is_well = status_.state == DaemonState::streaming;
  if (is_well && !(health.recording_fault.empty() && health.scan_fault.empty())) {
    status_.state = DaemonState::degraded;
  }
  add_reason(health.scan_fault);
  add_reason(health.recording_fault);
  // A fault that has just come is in a notice too, and is reported once.
  if (health.recording_fault.empty() ||
      stream_.notice.find(health.recording_fault) == std::string::npos) {
    add_reason(stream_.notice);
  }
  add_reason(health.configuration_fault);
  add_reason(stream_.device.caution);
}

void StatusReporter::add_reason(const std::string& sentence) {
  add_sentence(status_.reason, sentence);
}

void StatusReporter::judge_device(const StreamHealth& health) {
  status_.device = stream_.device.state;
  status_.device_name = stream_.device.device;
  if (stream_.device.state != DeviceState::connected) disturb();
  switch (stream_.device.state) {
    case DeviceState::no_device:
      status_.state = DaemonState::waiting_for_device;
      break;
    case DeviceState::failing:
      status_.state = DaemonState::degraded;
      break;
    case DeviceState::connected:
      judge_stream(health);
      add_reason(stream_.device.reason);
      return;
  }
  status_.reason = stream_.device.reason;
}

void StatusReporter::disturb() {
  stream_.gap_begin_ns = clock_.steady_ns();
  stream_.disturbed_until_ns = stream_.gap_begin_ns + ns_per_s;
}

bool StatusReporter::is_disturbed_frame() const {
  return clock_.steady_ns() < stream_.disturbed_until_ns &&
         (stream_.last_frame == FrameStatus::no_sync ||
          stream_.last_frame == FrameStatus::incomplete);
}

void StatusReporter::judge_stream(const StreamHealth& health) {
  const std::int64_t heard_ns =
      health.last_arrival_ns == 0 ? stream_.started_ns : health.last_arrival_ns;
  status_.reason.clear();
  if (stream_.source.live && health.ring_is_empty &&
      static_cast<double>(clock_.steady_ns() - heard_ns) > silence_limit_ns_) {
    status_.state = DaemonState::waiting_for_device;
    status_.reason = stream_.source.name + " sends nothing, not even a heartbeat";
    disturb();
  } else if (stream_.last_frame == FrameStatus::not_run) {
    status_.state = DaemonState::starting;
    status_.reason = second_.why();
  } else if (is_disturbed_frame()) {
    // The driver's own reason, if it has given one, goes before this sentence.
    status_.state = DaemonState::degraded;
    if (stream_.device.reason.empty()) {
      status_.reason =
          "the last frame spans a time in which " + stream_.source.name + " sent nothing";
    }
  } else {
    judge_frames(health);
  }
}

// What keeps the measurement from being ok first, then what it costs, then the surest finding.
void StatusReporter::judge_frames(const StreamHealth& health) {
  const bool last_is_bad = reason_of(stream_.last_frame) != nullptr;
  const bool falls_behind = stream_.source.live && !second_.of_cost().empty();
  const bool is_well =
      !last_is_bad && !second_.contradicts_pattern() && !effort_is_lowered() && !falls_behind;
  status_.state = is_well ? DaemonState::streaming : DaemonState::degraded;
  const std::string& measurement = second_.measurement();
  if (last_is_bad) status_.reason = reason_of_frame(stream_.last_frame, health);
  if (!last_is_bad || measurement != to_string(stream_.last_frame)) {
    add_reason(reason_of_measurement(health));
  }
  if (effort_is_lowered()) {
    add_reason("estimation is slower than the frames come: its effort is lowered to " +
               stream_.last_effort + " until it keeps up");
  } else {
    add_reason(second_.of_cost());
  }
  if (!last_is_bad && !second_.contradicts_pattern() && !second_.findings().empty()) {
    add_reason(with_advice(second_.findings().front()));
  }
  if (status_.pixels) add_reason(in_words(*status_.pixels));
}

std::string StatusReporter::reason_of_measurement(const StreamHealth& health) const {
  for (const FrameStatus status :
       {FrameStatus::no_sync, FrameStatus::incomplete, FrameStatus::saturated}) {
    if (second_.measurement() == to_string(status)) return reason_of_frame(status, health);
  }
  return second_.why();
}

std::string StatusReporter::reason_of_frame(FrameStatus status, const StreamHealth& health) const {
  if (health.clock_is_at_its_end) {
    return "the tagger's clock is within 5 h of the end of 63 bits of picoseconds, and all tags "
           "are "
           "lost: set the clock to zero";
  }
  if (status == FrameStatus::no_sync && !health.sync_fault.empty()) return health.sync_fault;
  if (status == FrameStatus::incomplete && stream_.ring_needed > 0) {
    return advice_on_room(stream_.ring_needed);
  }
  std::string reason = reason_of(status);
  if (status != FrameStatus::saturated) return reason;
  if (!dead_time_left_out_by_.empty()) {
    reason =
        "so much light that the detector's dead time biases the values, and it is not modelled "
        "with " +
        dead_time_left_out_by_ + ": do without that, or attenuate the light";
  } else if (models_dead_time_ && !stream_.knew_dead_time) {
    reason =
        "so much light that the detector's dead time biases the values, and detections contradict "
        "detector.dead_time_ns, as they follow each other sooner: give the dead time in the "
        "detector's data sheet";
  } else if (models_dead_time_ && !stream_.is_beyond_model) {
    reason =
        "the detector's inputs share the light so unevenly that pulses as bright as these bias the "
        "values: give the inputs even shares, or attenuate the light";
  }
  return reason;
}

// A recording has begun, ended or failed, or goes into another file than the last status said.
bool StatusReporter::is_turned(const StreamHealth& health) const {
  const auto& last = status_.recording;
  const auto& now = health.recording;
  if (!last || !now) return last.has_value() != now.has_value();
  return last->state != now->state || last->file != now->file;
}

void StatusReporter::publish(const StreamHealth& health) {
  status_.timestamp_s = timestamp_s();
  status_.recording = health.recording;
  status_.measurement = second_.measurement();
  status_.findings = second_.findings();
  status_.effort_is_lowered = effort_is_lowered();
  status_.tags = health.tags;
  status_.ring_fill_ratio = std::exchange(highest_fill_, 0);
  publisher_.publish_status(to_json(status_));
  ++status_.sequence;
  next_ns_ = clock_.steady_ns() + ns_per_s;
}

double StatusReporter::timestamp_s() const {
  return stream_.source.live ? clock_.unix_s() : stream_.last_frame_s;
}

}  // namespace splid
