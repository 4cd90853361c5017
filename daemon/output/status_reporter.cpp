#include "daemon/output/status_reporter.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "daemon/stream/frame_message.hpp"

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
      return "so much light that the detector's dead time biases the values: attenuate it "
             "(detector.dead_time modelled holds up to 10 detections in a dead time or a pulse)";
    default:
      return nullptr;
  }
}

void add_sentence(std::string& text, const std::string& sentence) {
  if (sentence.empty()) return;
  text += (text.empty() ? "" : "; ") + sentence;
}

std::string dead_time_in_words(double blind_ns) {
  return fmt::format(
      "the detector seems blind after each detection, for {:.3g} ns as far as the photons tell, "
      "which biases the values: set detector.dead_time_ns to the dead time in its data sheet",
      blind_ns);
}

std::string afterpulses_in_words(double share) {
  return fmt::format(
      "some {:.2g} % of detections are followed by another without light (afterpulses), which the "
      "background counts and its deviation holds: set a longer dead time (hold-off) at the "
      "detector, and detector.dead_time_ns to it",
      100 * share);
}

std::string misfit_in_words(double pulse_misfit) {
  if (pulse_misfit < 0) {
    return fmt::format(
        "the detected pulse is {:.0f} % narrower than the configured pulse: set pulse.sigma_ps, or "
        "calibrate the pulse",
        -100 * pulse_misfit);
  }
  return fmt::format(
      "the detected pulse is {:.0f} % wider than the configured pulse, and the deviations are "
      "widened "
      "by that: set pulse.width fitted where the target is tilted, the beam wide or the air foggy, "
      "scene.targets 2 where a second surface may be close behind, scene.motion accelerating where "
      "the path may bend, or else calibrate the pulse",
      100 * pulse_misfit);
}

// What no single frame shows is in no frame's deviations. Light from two delays or more that makes
// the pulse wider by the ratio r has the spread sqrt(r^2 - 1) in units of the pulse's width.
std::string mean_in_words(const PulseMean& pulse) {
  const double ratio = 1 + pulse.excess();
  const std::string how_much = fmt::format(
      "over the last frames the detected pulse is {:.1f} +- {:.1f} % {} than the configured pulse, "
      "which single frames do not show",
      100 * std::abs(pulse.excess()), 100 * pulse.deviation(), ratio < 1 ? "narrower" : "wider");
  if (ratio < 1) {
    return how_much +
           ": set scene.targets 2 where another surface is some pulse widths behind the target, or "
           "else pulse.sigma_ps, or calibrate the pulse";
  }
  return fmt::format(
      "{}: where a second surface is close behind the target, distances are off by up to {:.1f} of "
      "a pulse width and their deviations do not say so; set pulse.width fitted where the target "
      "is tilted, the beam wide or the air foggy, or else calibrate the pulse",
      how_much, std::sqrt(ratio * ratio - 1));
}

constexpr const char* for_no_gaussian =
    "set pulse.width fixed and scene.targets 2 where another surface is close to the target, or "
    "calibrate the pulse and set pulse.shape tabulated where the detector's pulse has a tail";

// Two surfaces of which one is half as bright have the skewness 2 (d / s)^3, where d is how far the
// brighter one is from the mean and s the width of both together.
std::string mean_in_words(const SkewMean& skew) {
  return fmt::format(
      "over the last frames the detected pulse has a skewness of {:+.2f} +- {:.2f}, which single "
      "frames do not show: distances are off by some {:.1f} of the fitted width and their "
      "deviations do not say so; {}",
      skew.excess(), skew.deviation(), std::cbrt(std::abs(skew.excess()) / 2), for_no_gaussian);
}

// A path whose acceleration changes moves the velocity by 2.3 of its deviations for each deviation
// of that change, and one that bends and is taken as straight moves the distance by 1.1.
std::string mean_in_words(const PathMean& path) {
  const std::string how_much = fmt::format(
      "over the last frames the target's path is off the fitted one by {:.2g} times what chance "
      "makes (rms), which single frames do not show",
      path.excess());
  if (!path.is_of_bent_paths()) {
    return how_much +
           ": the target accelerates, and distances or velocities are off by more than their "
           "deviations say; set scene.motion accelerating, or make frames shorter";
  }
  return fmt::format(
      "{}: its acceleration changes, and velocities are off by some {:.1f} of their deviations; "
      "make frames shorter",
      how_much, 2.3 * std::sqrt(std::max(0.0, path.excess() * path.excess() - 1)));
}

}  // namespace

StatusOptions status_options(const Config& config) {
  return {config.source_driver,
          config.pattern_file,
          config.pattern.mode,
          config.estimator.effort,
          config.frame.length_ms,
          static_cast<double>(config.pipeline.estimation_threads),
          unmodelled_by(config),
          config.detector.dead_time_ns > 0 && config.detector.dead_time == DeadTime::modelled &&
              unmodelled_by(config).empty()};
}

StatusReporter::StatusReporter(const StatusOptions& options, Publisher& publisher,
                               const Clock& clock)
    : publisher_(publisher),
      clock_(clock),
      threads_(options.estimation_threads),
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
  second_ = {};
  stream_.source = source;
  stream_.last_frame_s = source.start_unix_s.value_or(0);
  stream_.started_ns = clock_.steady_ns();
  status_.state = DaemonState::starting;
  status_.reason.clear();
  status_.device = DeviceState::connected;
  status_.device_name.clear();
  version_.timestamp_s = timestamp_s();
  publisher_.publish_version(to_json(version_));
  StreamHealth health;
  health.tags = status_.tags;
  publish(health);
}

void StatusReporter::frame_published(const FrameMessage& message) {
  ++status_.frames;
  if (message.valid()) ++status_.valid_frames;
  status_.lost_tags += message.lost_tags.value_or(0);
  status_.uncounted_losses += message.uncounted_losses;
  stream_.last_frame = message.status;
  stream_.knew_blind_time = message.blind_fraction.has_value();
  stream_.is_beyond_model =
      message.blind_fraction &&
      is_beyond_model(*message.blind_fraction, message.signal_per_pulse.value_or(0));
  if (!is_disturbed_frame()) stream_.disturbed_until_ns = 0;
  second_.frames += message.valid() ? 1 : 0;
  const bool by_mode = message.mode == Mode::ambiguous;
  second_.unsure += message.status == FrameStatus::ambiguous && !by_mode ? 1 : 0;
  if (message.amplitude_misfit) {
    ++second_.misfits;
    second_.amplitude_misfit = *message.amplitude_misfit;
  }
  if (message.pulse_misfit) {
    ++second_.pulse_misfits;
    second_.pulse_misfit = *message.pulse_misfit;
  }
  if (message.shape_misfit) {
    ++second_.shape_misfits;
    second_.shape_misfit = *message.shape_misfit;
  }
  if (message.valid()) {
    stream_.pulse.add(message);
    stream_.skew.add(message);
    stream_.path.add(message);
    second_.bent_paths += message.acceleration_mps2 ? 1 : 0;
  }
  if (message.acceleration_misfit_mps2) {
    ++second_.path_misfits;
    second_.acceleration_misfit_mps2 = *message.acceleration_misfit_mps2;
  }
  if (message.jerk_misfit_mps3) {
    ++second_.turns;
    second_.jerk_misfit_mps3 = *message.jerk_misfit_mps3;
  }
  if (message.signal_gap) {
    ++second_.gaps;
    second_.signal_gap = *message.signal_gap;
  }
  if (message.pattern_fault) {
    ++second_.faults;
    second_.pattern_fault = *message.pattern_fault;
  }
  if (message.dead_time_misfit_ns) {
    ++second_.blinds;
    second_.dead_time_misfit_ns = *message.dead_time_misfit_ns;
  }
  if (message.afterpulse_misfit) {
    ++second_.afterpulses;
    second_.afterpulse_misfit = *message.afterpulse_misfit;
  }
  second_.computed_ms += message.compute_ms.value_or(0);
  second_.lasted_ms += message.duration_ms;
  stream_.last_effort = message.effort.value_or(configured_effort_);
  stream_.last_frame_s = message.timestamp_s;
}

void StatusReporter::tick(const StreamHealth& health) {
  highest_fill_ = std::max(highest_fill_, health.ring_fill_ratio);
  for (const DeviceReport& report : health.device_reports) {
    stream_.device = report;
    judge(health);
    publish(health);
  }
  for (const std::string& notice : health.notices) {
    stream_.notice = notice;
    judge(health);
    publish(health);
  }
  if (clock_.steady_ns() >= next_ns_) judge_second();
  const DaemonState state = status_.state;
  const std::string reason = status_.reason;
  judge(health);
  const bool due = clock_.steady_ns() >= next_ns_;
  const bool is_new = state != status_.state || reason != status_.reason || is_turned(health);
  if (due || is_new) publish(health);
  // Notices, and the reasons of faults that are over, have now been published for a second.
  if (!due) return;
  stream_.notice.clear();
  if (stream_.device.state == DeviceState::connected) stream_.device.reason.clear();
}

void StatusReporter::wait(const StreamHealth& health, const std::string& reason) {
  const bool due = clock_.steady_ns() >= next_ns_;
  if (!std::exchange(waits_, true)) {
    stream_.notice.clear();
    stream_.pattern_reason.clear();
    second_ = {};
  }
  for (const std::string& notice : health.notices) stream_.notice = notice;
  const std::string said = std::exchange(status_.reason, reason);
  add_reason(stream_.notice);
  add_reason(health.configuration_fault);
  const bool is_new = status_.state != DaemonState::waiting_for_device || status_.reason != said;
  status_.state = DaemonState::waiting_for_device;
  status_.device_name.clear();  // no instrument is open
  highest_fill_ = 0;
  if (due || is_new) publish(health);
  if (due) stream_.notice.clear();
}

void StatusReporter::stop(const StreamHealth& health, const std::string& reason) {
  highest_fill_ = std::max(highest_fill_, health.ring_fill_ratio);
  status_.state = DaemonState::stopping;
  status_.reason = reason;
  // Of a stream that is over within its first second no second has been judged yet.
  judge_second();
  add_reason(stream_.pattern_reason);
  publish(health);
}

void StatusReporter::judge(const StreamHealth& health) {
  judge_device(health);
  const bool is_well = status_.state == DaemonState::streaming;
  if (is_well && !health.recording_fault.empty()) status_.state = DaemonState::degraded;
  add_reason(health.recording_fault);
  // A fault that has just come is in a notice too, and is said once.
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
      if (!status_.reason.empty()) return;
  }
  status_.reason = stream_.device.reason;
}

// A finding counts from half of a second's frames on: chance makes one frame in a million show it.
void StatusReporter::judge_second() {
  judge_cost();
  const bool is_blind = second_.blinds > 0 && 2 * second_.blinds >= second_.frames;
  stream_.dead_time_reason = is_blind ? dead_time_in_words(second_.dead_time_misfit_ns) : "";
  const bool is_contradicted = second_.faults > 0 && second_.faults >= second_.frames;
  stream_.pattern_reason = !is_contradicted ? ""
                           : is_blind       ? stream_.dead_time_reason
                                            : in_words(second_.pattern_fault);
  stream_.frames_reason = stream_.dead_time_reason;
  if (!is_blind) judge_pulses();
  judge_paths();
  if (second_.afterpulses > 0 && 2 * second_.afterpulses >= second_.frames) {
    add_sentence(stream_.frames_reason, afterpulses_in_words(second_.afterpulse_misfit));
  }
  if (second_.unsure > 0 && 2 * second_.unsure >= second_.frames) {
    add_sentence(stream_.frames_reason,
                 fmt::format("{} of the last {} frames are ambiguous: their photons fit another "
                             "range nearly as well (range_odds_nats); more light, longer frames or "
                             "a pattern that fits itself less tell them apart (splid check says "
                             "how many signal photons this pattern takes)",
                             second_.unsure, second_.frames));
  }
  second_ = {};
}

// The light of the pulses against the configured ones. A detector that is blind for longer than is
// known hides pulses behind others, and makes each of them narrower: then nothing is wrong with the
// configured pulses.
void StatusReporter::judge_pulses() {
  if (second_.misfits > 0 && 2 * second_.misfits >= second_.frames) {
    stream_.frames_reason = "the pulses' light is " +
                            fmt::format("{:.0f}", 100 * second_.amplitude_misfit) +
                            " % (rms) off the pattern's amplitudes: calibrate the pattern";
  }
  if (second_.pulse_misfits > 0 && 2 * second_.pulse_misfits >= second_.frames) {
    add_sentence(stream_.frames_reason, misfit_in_words(second_.pulse_misfit));
  } else if (second_.frames > 0 && stream_.pulse.is_sure()) {
    add_sentence(stream_.frames_reason, mean_in_words(stream_.pulse));
  }
  if (second_.shape_misfits > 0 && 2 * second_.shape_misfits >= second_.frames) {
    add_sentence(stream_.frames_reason,
                 fmt::format("the detected pulse is no gaussian, by {:.0f} % (rms), and the "
                             "deviations are widened by that: {}",
                             100 * second_.shape_misfit, for_no_gaussian));
  } else if (second_.frames > 0 && stream_.skew.is_sure()) {
    add_sentence(stream_.frames_reason, mean_in_words(stream_.skew));
  }
}

// The light against the path that was fitted.
void StatusReporter::judge_paths() {
  const bool is_bent = 2 * second_.bent_paths > second_.frames;
  const bool bends = second_.path_misfits > 0 && 2 * second_.path_misfits >= second_.frames;
  const bool turns = second_.turns > 0 && 2 * second_.turns >= second_.frames;
  if (bends) {
    add_sentence(stream_.frames_reason,
                 fmt::format("the target accelerates by some {:.2g} m/s^2, and its path was taken "
                             "as straight: set scene.motion auto or accelerating, or make frames "
                             "shorter",
                             second_.acceleration_misfit_mps2));
  }
  if (turns) {
    add_sentence(stream_.frames_reason,
                 fmt::format("the target's acceleration changes by some {:.2g} m/s^3, which no "
                             "fitted path knows, and the deviations of the velocity are widened by "
                             "that: make frames shorter",
                             second_.jerk_misfit_mps3));
  }
  if (!bends && !turns && second_.frames > 0 && stream_.path.is_sure()) {
    add_sentence(stream_.frames_reason, mean_in_words(stream_.path));
  }
  if (second_.gaps > 0 && 2 * second_.gaps >= second_.frames) {
    add_sentence(stream_.frames_reason,
                 fmt::format("the target's light is missing in {:.0f} % of a frame's time: the "
                             "target comes and goes, or its path bends away from {}",
                             100 * second_.signal_gap,
                             is_bent ? "one of constant acceleration, for which make frames shorter"
                                     : "a straight path, for which set scene.motion auto or "
                                       "accelerating"));
  }
}

// Frames of a live source come as fast as they last; where they take longer than that to compute,
// on all threads together, splid falls behind.
void StatusReporter::judge_cost() {
  stream_.cost_reason.clear();
  if (second_.computed_ms > second_.lasted_ms * threads_) {
    stream_.cost_reason = fmt::format(
        "frames take {:.3g} times as long to compute as they last, on {:.0f} threads: lower "
        "estimator.effort or scene.max_speed_mps, or raise pipeline.estimation_threads",
        second_.computed_ms / second_.lasted_ms, threads_);
  }
}

void StatusReporter::disturb() { stream_.disturbed_until_ns = clock_.steady_ns() + ns_per_s; }

bool StatusReporter::is_disturbed_frame() const {
  return clock_.steady_ns() < stream_.disturbed_until_ns &&
         (stream_.last_frame == FrameStatus::no_sync ||
          stream_.last_frame == FrameStatus::incomplete);
}

void StatusReporter::judge_stream(const StreamHealth& health) {
  const std::int64_t heard_ns =
      health.last_arrival_ns == 0 ? stream_.started_ns : health.last_arrival_ns;
  status_.reason.clear();
  if (stream_.source.live &&
      static_cast<double>(clock_.steady_ns() - heard_ns) > silence_limit_ns_) {
    status_.state = DaemonState::waiting_for_device;
    status_.reason = stream_.source.name + " sends nothing, not even a heartbeat";
    disturb();
  } else if (stream_.last_frame == FrameStatus::not_run) {
    status_.state = DaemonState::starting;
  } else if (is_disturbed_frame()) {
    // The driver's own words, where it has said any, go before this sentence.
    status_.state = DaemonState::degraded;
    if (stream_.device.reason.empty()) {
      status_.reason =
          "the last frame spans a time in which " + stream_.source.name + " sent nothing";
    }
  } else if (reason_of(stream_.last_frame) != nullptr) {
    status_.state = DaemonState::degraded;
    status_.reason = reason_of_last_frame(health);
  } else if (!stream_.pattern_reason.empty()) {
    status_.state = DaemonState::degraded;
    status_.reason = stream_.pattern_reason;
  } else if (effort_is_lowered()) {
    status_.state = DaemonState::degraded;
    status_.reason = "estimation is slower than the frames come: its effort is lowered to " +
                     stream_.last_effort + " until it keeps up";
  } else {
    const bool falls_behind = stream_.source.live && !stream_.cost_reason.empty();
    status_.state = falls_behind ? DaemonState::degraded : DaemonState::streaming;
    status_.reason = stream_.cost_reason;
    add_reason(stream_.frames_reason);
  }
}

std::string StatusReporter::reason_of_last_frame(const StreamHealth& health) const {
  if (stream_.last_frame == FrameStatus::no_sync && !health.sync_fault.empty()) {
    return health.sync_fault;
  }
  std::string reason = reason_of(stream_.last_frame);
  if (stream_.last_frame != FrameStatus::saturated) return reason;
  if (!dead_time_left_out_by_.empty()) {
    reason =
        "so much light that the detector's dead time biases the values, and it is not modelled "
        "with " +
        dead_time_left_out_by_ + ": do without that, or attenuate the light";
  } else if (models_dead_time_ && !stream_.knew_blind_time) {
    reason =
        "so much light that the detector's dead time biases the values, and detections contradict "
        "detector.dead_time_ns, as they follow each other sooner: give the dead time in the "
        "detector's data sheet";
  } else if (models_dead_time_ && !stream_.is_beyond_model) {
    reason =
        "the detector's inputs share the light so unevenly that pulses as bright as these bias the "
        "values: give the inputs even shares, or attenuate the light";
  }
  add_sentence(reason, stream_.dead_time_reason);
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
