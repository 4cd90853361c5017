#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "protocol/device_report.hpp"
#include "protocol/pattern.hpp"

namespace splid {

enum class FrameStatus {
  not_run,     // never published
  ok,          // all values hold
  no_target,   // significance below what the false-alarm rate asks for
  ambiguous,   // as ok, but the mode, or the photons of this frame, cannot tell which range
  incomplete,  // less than frame.min_seen_fraction of the frame was seen
  no_sync,     // too few pattern syncs to place the pattern in time
  saturated,   // so many photons that the detector's dead time would bias the values
};

const char* to_string(FrameStatus status);

// What a frame's photons have against the pattern in use, so that no delay of it is a target's.
enum class PatternFault {
  none,
  dark_pulses,   // most pulses of the pattern get no light where the others get it
  stray_pulses,  // most light comes in pulses that the pattern does not have
};

const char* to_string(PatternFault fault);

// The `frame` message. What is not known is absent, never zero. Frame of reference: distance and
// velocity along the line of sight, positive away from the lidar, at mid-frame.
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
  std::optional<double> signal_per_pulse, std_signal_per_pulse;
  std::optional<double> background_per_s, std_background_per_s;
  std::optional<double> signal_per_period, background_per_period;  // counts a pattern period
  std::optional<double> sbr;               // signal counts over background counts
  std::optional<double> delay_ns;          // round trip at the frame's start
  std::optional<double> significance;      // nats gained over no target
  std::optional<double> range_odds_nats;   // of the range against all others, log of the odds
  std::optional<double> amplitude_misfit;  // rms deviation of the pulses' light from the pattern's
                                           // amplitudes, relative, where it is surely there
  std::optional<PatternFault> pattern_fault;  // of a no_target: why, where it is the pattern's

  // What the frame was made of.
  std::optional<std::uint64_t> photons;
  std::optional<std::uint64_t> lost_tags;  // known count
  std::uint64_t uncounted_losses = 0;      // that took nobody knows how many tags
  std::optional<double> seen_fraction;     // 0 to 1, of the frame's time

  struct Sync {
    std::uint64_t count = 0;     // sync tags in the frame
    std::uint64_t missing = 0;   // pattern periods without one
    std::uint64_t spurious = 0;  // sync tags that fit no period, and doubles
    std::optional<double> period_ps, drift_ppm, jitter_ps;
  };
  std::optional<Sync> sync;

  struct Reference {
    std::optional<double> distance_m, velocity_mps;
  };
  std::optional<Reference> reference;  // encoder

  std::optional<std::string> effort;
  std::optional<double> compute_ms;  // estimation of this frame, wall time on its thread
  std::optional<double> latency_ms;  // from the last tag's arrival in the ring to publication

  [[nodiscard]] bool valid() const {
    return status == FrameStatus::ok || status == FrameStatus::ambiguous;
  }
};

enum class DaemonState { starting, waiting_for_device, streaming, degraded, stopping };

const char* to_string(DaemonState state);

// The `status` message: once a second and on every change.
struct StatusMessage {
  double timestamp_s = 0;
  std::uint64_t sequence = 0;
  DaemonState state = DaemonState::starting;
  std::string reason;  // one sentence; empty when there is nothing to say
  std::string source;  // driver's name
  DeviceState device = DeviceState::connected;
  std::uint64_t tags = 0;       // events taken from the source
  std::uint64_t lost_tags = 0;  // known count
  std::uint64_t frames = 0;     // published
  std::uint64_t valid_frames = 0;
  double ring_fill_ratio = 0;  // 0 to 1, highest since the last status
  // The instrument that is read, as its driver tells it from others; empty: left out.
  std::string device_name = {};
  std::uint64_t uncounted_losses = 0;  // that took nobody knows how many tags
};

// The `version` message: what a new subscriber gets first.
struct VersionMessage {
  double timestamp_s = 0;
  std::uint64_t sequence = 0;
  std::string release;  // of the program
  std::string pattern;  // name of the pattern in use: its file's stem
  Mode mode = Mode::baseline;
};

inline constexpr const char* topic_frame = "frame";
inline constexpr const char* topic_status = "status";
inline constexpr const char* topic_version = "version";

// One line of JSON without a line feed. Numbers print with the fewest digits that read back as the
// same double; integers that may pass 2^53 (start_ps) are strings; absent members are left out, and
// so is any number that is not finite.
std::string to_json(const FrameMessage& message);
std::string to_json(const StatusMessage& message);
std::string to_json(const VersionMessage& message);

// Errors: Error(Fault::data) naming the member that is missing or of the wrong type.
FrameMessage frame_from_json(const std::string& json);

}  // namespace splid
