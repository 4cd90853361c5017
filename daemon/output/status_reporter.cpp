#include "daemon/output/status_reporter.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "daemon/base/format.hpp"
#include "daemon/output/frame_message.hpp"

namespace splid {
namespace {

constexpr std::int64_t ns_per_s = 1'000'000'000;
constexpr double ns_per_ms = 1e6;

// A live source that says nothing for this many frames is silent: it owes a heartbeat every 10 ms.
constexpr double silent_frames = 4;

const char* reason_of(FrameStatus status) {
  switch (status) {
    case FrameStatus::no_sync:
      return "the last frame had too few pattern syncs: look at channels.sync and its cable";
    case FrameStatus::incomplete:
      return "tags are being lost: the last frame saw less than frame.min_seen_fraction";
    case FrameStatus::saturated:
      return "so much light that the detector's dead time biases the values: attenuate it";
    default:
      return nullptr;
  }
}

}  // namespace

StatusReporter::StatusReporter(const Config& config, const SourceInfo& source, Publisher& publisher,
                               const Clock& clock)
    : source_(source),
      publisher_(publisher),
      clock_(clock),
      last_frame_s_(source.start_unix_s.value_or(0)),
      silence_limit_ns_(std::max(silent_frames * config.frame.length_ms, 100.0) * ns_per_ms) {
  version_.release = SPLID_VERSION;
  version_.pattern = std::filesystem::path(config.pattern_file).stem().string();
  version_.mode = config.pattern.mode;
  status_.source = config.source_driver;
  configure(config.estimator.effort);
  threads_ = static_cast<double>(config.pipeline.estimation_threads);
}

void StatusReporter::start() {
  version_.timestamp_s = timestamp_s();
  publisher_.publish_version(to_json(version_));
  started_ns_ = clock_.steady_ns();
  StreamHealth health;
  health.tags = status_.tags;
  publish(health);
}

void StatusReporter::go_on_from(const StatusMessage& before) {
  status_.sequence = before.sequence;
  status_.tags = before.tags;
  status_.lost_tags = before.lost_tags;
  status_.uncounted_losses = before.uncounted_losses;
  status_.frames = before.frames;
  status_.valid_frames = before.valid_frames;
}

void StatusReporter::frame_published(const FrameMessage& message) {
  ++status_.frames;
  if (message.valid()) ++status_.valid_frames;
  status_.lost_tags += message.lost_tags.value_or(0);
  status_.uncounted_losses += message.uncounted_losses;
  last_frame_ = message.status;
  if (!is_disturbed_frame()) disturbed_until_ns_ = 0;
  frames_this_second_ += message.valid() ? 1 : 0;
  const bool by_mode = message.mode == Mode::ambiguous;
  unsure_this_second_ += message.status == FrameStatus::ambiguous && !by_mode ? 1 : 0;
  if (message.amplitude_misfit) {
    ++misfits_this_second_;
    amplitude_misfit_ = *message.amplitude_misfit;
  }
  if (message.pattern_fault) {
    ++faults_this_second_;
    pattern_fault_ = *message.pattern_fault;
  }
  computed_ms_ += message.compute_ms.value_or(0);
  lasted_ms_ += message.duration_ms;
  last_effort_ = message.effort.value_or(configured_effort_);
  last_frame_s_ = message.timestamp_s;
}

void StatusReporter::tick(const StreamHealth& health) {
  highest_fill_ = std::max(highest_fill_, health.ring_fill_ratio);
  for (const DeviceReport& report : health.device_reports) {
    device_ = report;
    judge(health);
    publish(health);
  }
  for (const std::string& notice : health.notices) {
    notice_ = notice;
    judge(health);
    publish(health);
  }
  if (clock_.steady_ns() >= next_ns_) judge_second();
  const DaemonState state = status_.state;
  const std::string reason = status_.reason;
  judge(health);
  const bool due = clock_.steady_ns() >= next_ns_;
  if (due || state != status_.state || reason != status_.reason) publish(health);
  // What is over has then been said for a second.
  if (!due) return;
  notice_.clear();
  if (device_.state == DeviceState::connected) device_.reason.clear();
}

void StatusReporter::stop(const StreamHealth& health, const std::string& reason) {
  highest_fill_ = std::max(highest_fill_, health.ring_fill_ratio);
  status_.state = DaemonState::stopping;
  status_.reason = reason;
  // A stream that is over within its first second has said nothing yet.
  judge_second();
  add_reason(pattern_reason_);
  publish(health);
}

void StatusReporter::judge(const StreamHealth& health) {
  judge_device(health);
  const bool is_well = status_.state == DaemonState::streaming;
  if (is_well && !health.recording_fault.empty()) status_.state = DaemonState::degraded;
  add_reason(health.recording_fault);
  // A fault that has just come is noticed too.
  if (health.recording_fault.empty() || notice_.find(health.recording_fault) == std::string::npos) {
    add_reason(notice_);
  }
  add_reason(health.configuration_fault);
  add_reason(device_.caution);
}

void StatusReporter::add_reason(const std::string& sentence) {
  if (sentence.empty()) return;
  status_.reason += (status_.reason.empty() ? "" : "; ") + sentence;
}

void StatusReporter::judge_device(const StreamHealth& health) {
  status_.device = device_.state;
  status_.device_name = device_.device;
  if (device_.state != DeviceState::connected) disturb();
  switch (device_.state) {
    case DeviceState::no_device:
      status_.state = DaemonState::waiting_for_device;
      break;
    case DeviceState::failing:
      status_.state = DaemonState::degraded;
      break;
    case DeviceState::connected:
      judge_stream(health);
      if (!status_.reason.empty()) return;
  }
  status_.reason = device_.reason;
}

// In half of a second's frames: chance shows one in a million a frame.
void StatusReporter::judge_second() {
  judge_cost();
  const bool is_contradicted =
      faults_this_second_ > 0 && faults_this_second_ >= frames_this_second_;
  pattern_reason_ = is_contradicted ? in_words(pattern_fault_) : "";
  frames_reason_.clear();
  if (misfits_this_second_ > 0 && 2 * misfits_this_second_ >= frames_this_second_) {
    frames_reason_ = "the pulses' light is " + format("%.0f", 100 * amplitude_misfit_) +
                     " % (rms) off the pattern's amplitudes: calibrate the pattern";
  }
  if (unsure_this_second_ > 0 && 2 * unsure_this_second_ >= frames_this_second_) {
    frames_reason_ += (frames_reason_.empty() ? "" : "; ") +
                      format(
                          "%d of the last %d frames are ambiguous: their photons fit another "
                          "range nearly as well (range_odds_nats); more light, longer frames or "
                          "a pattern that fits itself less tell them apart (splid check says how "
                          "many signal photons this one takes)",
                          unsure_this_second_, frames_this_second_);
  }
  frames_this_second_ = misfits_this_second_ = unsure_this_second_ = faults_this_second_ = 0;
}

// Frames that come as fast as they last are too much for the threads that share them.
void StatusReporter::judge_cost() {
  cost_reason_.clear();
  if (computed_ms_ > lasted_ms_ * threads_) {
    cost_reason_ = format(
        "frames take %.3g times as long to compute as they last, on %.0f threads: lower "
        "estimator.effort or scene.max_speed_mps, or raise pipeline.estimation_threads",
        computed_ms_ / lasted_ms_, threads_);
  }
  computed_ms_ = lasted_ms_ = 0;
}

void StatusReporter::disturb() { disturbed_until_ns_ = clock_.steady_ns() + ns_per_s; }

bool StatusReporter::is_disturbed_frame() const {
  return clock_.steady_ns() < disturbed_until_ns_ &&
         (last_frame_ == FrameStatus::no_sync || last_frame_ == FrameStatus::incomplete);
}

void StatusReporter::judge_stream(const StreamHealth& health) {
  const std::int64_t heard_ns = health.last_arrival_ns == 0 ? started_ns_ : health.last_arrival_ns;
  status_.reason.clear();
  if (source_.live && static_cast<double>(clock_.steady_ns() - heard_ns) > silence_limit_ns_) {
    status_.state = DaemonState::waiting_for_device;
    status_.reason = source_.name + " sends nothing, not even a heartbeat";
    disturb();
  } else if (last_frame_ == FrameStatus::not_run) {
    status_.state = DaemonState::starting;
  } else if (is_disturbed_frame()) {
    // What the driver said of it goes before.
    status_.state = DaemonState::degraded;
    if (device_.reason.empty()) {
      status_.reason = "the last frame spans a time in which " + source_.name + " sent nothing";
    }
  } else if (const char* reason = reason_of(last_frame_)) {
    status_.state = DaemonState::degraded;
    status_.reason = last_frame_ == FrameStatus::no_sync && !health.sync_fault.empty()
                         ? health.sync_fault
                         : reason;
  } else if (!pattern_reason_.empty()) {
    status_.state = DaemonState::degraded;
    status_.reason = pattern_reason_;
  } else if (effort_is_lowered()) {
    status_.state = DaemonState::degraded;
    status_.reason = "estimation is slower than the frames come: its effort is lowered to " +
                     last_effort_ + " until it keeps up";
  } else {
    const bool falls_behind = source_.live && !cost_reason_.empty();
    status_.state = falls_behind ? DaemonState::degraded : DaemonState::streaming;
    status_.reason = cost_reason_;
    add_reason(frames_reason_);
  }
}

void StatusReporter::publish(const StreamHealth& health) {
  status_.timestamp_s = timestamp_s();
  status_.tags = health.tags;
  status_.ring_fill_ratio = std::exchange(highest_fill_, 0);
  publisher_.publish_status(to_json(status_));
  ++status_.sequence;
  next_ns_ = clock_.steady_ns() + ns_per_s;
}

double StatusReporter::timestamp_s() const {
  return source_.live ? clock_.unix_s() : last_frame_s_;
}

}  // namespace splid
