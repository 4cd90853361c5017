#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "daemon/stream/frame.hpp"
#include "daemon/stream/scan_directions.hpp"
#include "estimator/model/estimate.hpp"
#include "protocol/frame_json.hpp"

namespace splid {

// What does not change from frame to frame.
struct FrameContext {
  Mode mode = Mode::baseline;
  double range_offset_m = 0;        // of the instrument, subtracted from each distance
  double min_seen_fraction = 0;     // below it a frame is incomplete
  double dead_time_ns = 0;          // 0: not known
  bool models_dead_time = false;    // detector.dead_time
  double inputs = 1;                // of the detector, that share the light
  double period_ps = 0;             // of the pattern, for frames that did not measure it
  double amplitude_per_period = 0;  // of all pulses in one pattern period
  double mean_amplitude = 1;        // of a pulse
  bool lists_targets = false;       // scene.targets is more than 1
  // The source counts syncs and does not time them (SourceInfo): frames have no `sync`.
  bool syncs_are_counted = false;
  // Where a scanner looks, to which a pixel's own direction is added; null: not known.
  std::shared_ptr<const ScanDirections> directions = nullptr;
  std::optional<double> azimuth_deg = {}, elevation_deg = {};  // of the pixel
};

// Errors: those of ScanDirections.
FrameContext frame_context(const Config& config);

// When things happened to a frame, and how hard it was looked at.
struct FrameTiming {
  double mid_unix_s = 0;   // UTC at mid-frame
  double compute_ms = 0;   // of its estimation
  double latency_ms = -1;  // arrival of its last tag to publication; negative: no tag
  Effort effort = Effort::balanced;
};

// What is published of a frame. The status is the estimate's, with three exceptions, of which the
// first that holds counts: `no_sync` where the frame did not lock, `incomplete` where less than
// min_seen_fraction was seen, `saturated` where the dead time biases the values. If it is modelled,
// that is where light is beyond the model, or is shared by the inputs so unevenly that a value is
// low by half of its deviation. If it is not, it is where more than a tenth of the signal photons
// would fall into it; or, where it is to be modelled and is left out, or detections contradict it,
// so many that the signal is low by half of its deviation.
FrameMessage make_frame_message(const Frame& frame, const Estimate& estimate,
                                const FrameContext& context, const FrameTiming& times);

// Whether there is more light than the model of the dead time is for. in_a_pulse: signal photons in
// a pulse of mean amplitude.
bool is_beyond_model(double blind_fraction, double in_a_pulse);

// What leaves a dead time out that is given and to be modelled: a key with its value; empty where
// nothing does.
std::string unmodelled_by(const Config& config);

// With the units and the advice of checks/finding.hpp.
std::vector<FrameMessage::Finding> to_message(const FoundList& found);

// The finding that the photons contradict the pattern in use; null where the frame has none, or a
// status other than no_target.
const FrameMessage::Finding* pattern_finding(const FrameMessage& message);

}  // namespace splid
