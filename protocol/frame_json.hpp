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
  std::optional<double> pulse_sigma_ps, std_pulse_sigma_ps;  // where pulse.width is fitted
  std::optional<double> blind_fraction;  // of the time seen; where the dead time is modelled

  // What the photons say beyond the configured model: a richer model explains them better.
  struct Finding {
    std::string name;
    double value = 0, std = 0;
    std::string unit;  // of both; empty: a ratio
    double gain_nats = 0;
    std::string advice;  // a sentence: what to do, with the key of the configuration
    friend bool operator==(const Finding&, const Finding&) = default;
  };
  std::vector<Finding> findings;  // the surest first

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
    std::vector<Finding> findings;
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

  // Which dwell of a scan it is; all counts from 0.
  struct Scan {
    std::uint64_t picture = 0, line = 0, column = 0;
    std::optional<double> azimuth_deg, elevation_deg;  // to the right and up
  };
  std::optional<Scan> scan = {};

  std::optional<std::string> effort;
  std::optional<double> compute_ms;  // estimation of this frame, wall time on its thread
  std::optional<double> latency_ms;  // from the last tag's arrival in the ring to publication

  std::string pixel = {};  // its name, where there are several

  [[nodiscard]] bool valid() const {
    return status == FrameStatus::ok || status == FrameStatus::ambiguous;
  }
};

inline constexpr const char* topic_frame = "frame";

// One line of JSON without a line feed. Numbers print with the fewest digits that read back as the
// same double; integers that may pass 2^53 (start_ps) are strings; absent members are left out, and
// so is any number that is not finite.
std::string to_json(const FrameMessage& message);

// An array of findings, as in a frame.
std::string to_json(const std::vector<FrameMessage::Finding>& findings);
// Those of any message; none where it has none, and where they cannot be read.
std::vector<FrameMessage::Finding> findings_from_json(const std::string& json);

// Errors: Error(Fault::data) naming the member that is missing or of the wrong type.
FrameMessage frame_from_json(const std::string& json);

}  // namespace splid
