#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/frame_status.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// The `frame` message: what splid publishes of each frame, and its JSON
// (docs/reference/messages.md). daemon/stream/frame_message.hpp fills it from an estimate.
//
// A value that is not known is absent, never zero. Distance and velocity are along the line of
// sight, positive away from the lidar, at mid-frame.
struct FrameMessage {
  // Always present.
  double timestamp_s = 0;      // UTC at mid-frame; for a replay the recording's own time
  std::uint64_t sequence = 0;  // counts frames from 0
  FrameStatus status = FrameStatus::not_run;
  Mode mode = Mode::baseline;
  std::int64_t start_ps = 0;  // tagger's clock
  double duration_ms = 0;

  // Estimates; std_* are one standard deviation.
  std::optional<double> distance_m, std_distance_m;
  std::optional<double> velocity_mps, std_velocity_mps;
  std::optional<double> acceleration_mps2, std_acceleration_mps2;
  std::optional<double> signal_per_pulse, std_signal_per_pulse;
  std::optional<double> background_per_s, std_background_per_s;
  std::optional<double> signal_per_period, background_per_period;  // counts a pattern period
  std::optional<double> sbr;              // signal counts over background counts
  std::optional<double> delay_ns;         // round trip at the frame's start
  std::optional<double> significance;     // nats gained over no target
  std::optional<double> range_odds_nats;  // log of the odds of this range against all others
  // The relative rms deviation of the pulses' light from the pattern's amplitudes, where the target
  // is surely there.
  std::optional<double> amplitude_misfit;
  // By how much the detected pulse is wider than the configured pulse, relative to the configured
  // width; negative where it is narrower. There only where it surely is wider or narrower.
  std::optional<double> pulse_misfit;
  // By how much the pulse appears wider, sure or not: to be averaged over frames.
  std::optional<double> pulse_excess, std_pulse_excess;
  // About how much the target accelerates although its path was taken as straight. There only where
  // it surely accelerates.
  std::optional<double> acceleration_misfit_mps2;
  // About how much its acceleration changes although the fitted path's does not, where it surely
  // does; and by how many of chance's deviations the path appears to be another, sure or not.
  std::optional<double> jerk_misfit_mps3, path_excess;
  std::optional<double> signal_gap;  // 0 to 1: of the frame, where the target's light is missing
  std::optional<double> pulse_sigma_ps, std_pulse_sigma_ps;  // where pulse.width is fitted
  // How far the light then is from a gaussian, relative rms, where it surely is none; and its
  // skewness, sure or not: to be averaged over frames.
  std::optional<double> shape_misfit;
  std::optional<double> pulse_skew, std_pulse_skew;
  std::optional<double> blind_fraction;  // of the time seen; where the dead time is modelled
  // How long the detector is blind after each detection, as the photons show it. There only where
  // that is longer than the configured dead time and biases the values.
  std::optional<double> dead_time_misfit_ns;
  // The share of detections that an afterpulse follows. There only where that surely raises the
  // background.
  std::optional<double> afterpulse_misfit;
  // Relative root mean square by which the light varies within the frame, where the dead time then
  // makes values too low; the status is `saturated`.
  std::optional<double> flicker_misfit;
  std::optional<PatternFault> pattern_fault;  // of a no_target whose reason is the pattern

  // One of several targets; its members are as those of the frame.
  struct Target {
    FrameStatus status = FrameStatus::not_run;  // ok or ambiguous
    std::optional<double> distance_m, std_distance_m;
    std::optional<double> velocity_mps, std_velocity_mps;
    std::optional<double> signal_per_pulse, std_signal_per_pulse;
    std::optional<double> signal_per_period;
    std::optional<double> delay_ns;
    std::optional<double> significance;  // nats gained over the frame's other targets alone
    std::optional<double> range_odds_nats;
    std::optional<double> amplitude_misfit;
    std::optional<double> pulse_misfit;
    std::optional<double> acceleration_misfit_mps2, jerk_misfit_mps3;
    std::optional<double> signal_gap;
    // Log of the odds that it is a target, against the flank of a brighter one's pulse.
    std::optional<double> shape_odds_nats;
  };
  // The frame's targets in descending order of their signal; the members above are those of the
  // first target. There where scene.targets is more than 1; then empty where the frame shows no
  // target.
  std::optional<std::vector<Target>> targets;

  // What the frame was made of.
  std::optional<std::uint64_t> photons;
  std::optional<std::uint64_t> lost_tags;  // known count
  std::uint64_t uncounted_losses = 0;      // losses that took an unknown number of tags
  std::optional<double> seen_fraction;     // 0 to 1, of the frame's time

  struct Sync {
    std::uint64_t count = 0;     // sync tags in the frame
    std::uint64_t missing = 0;   // pattern periods without a sync tag
    std::uint64_t spurious = 0;  // sync tags that fit no period, and doubles
    std::optional<double> period_ps, drift_ppm, jitter_ps;
  };
  std::optional<Sync> sync;

  struct Reference {
    std::optional<double> distance_m, velocity_mps;
  };
  std::optional<Reference> reference;  // what an encoder on the target says

  std::optional<std::string> effort;
  std::optional<double> compute_ms;  // estimation of this frame, wall time on its thread
  std::optional<double> latency_ms;  // from the last tag's arrival in the ring to publication

  [[nodiscard]] bool valid() const {
    return status == FrameStatus::ok || status == FrameStatus::ambiguous;
  }
};

inline constexpr const char* topic_frame = "frame";

// One line of JSON without a line feed. Numbers print with the fewest digits that read back as the
// same double; integers that may pass 2^53 (start_ps) are strings; absent members are left out, and
// so is any number that is not finite.
std::string to_json(const FrameMessage& message);

// Errors: Error(Fault::data) naming the member that is missing or of the wrong type.
FrameMessage frame_from_json(const std::string& json);

}  // namespace splid
