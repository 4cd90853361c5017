#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "drivers/simulator/simulator_options.hpp"
#include "estimator/model/frame_view.hpp"
#include "protocol/truth.hpp"

namespace splid {

// Where a target is at mid-frame.
struct TargetState {
  double delay_ns = 0;  // round trip, electronics included; not wrapped to the pattern's range
  double velocity_mps = 0;
};

// A frame that owns its tags, to be estimated again and again.
struct KeptFrame {
  std::int64_t start_ps = 0;  // tagger's clock
  std::int64_t end_ps = 0;
  std::vector<std::int64_t> photons_ps;
  std::vector<Loss> losses;
  SyncFit sync;
  double seen_fraction = 0;
  bool first = false;                // of a run: to be estimated, but not to be judged
  std::optional<TargetState> truth;  // absent where nobody knows

  [[nodiscard]] FrameView view() const { return {start_ps, end_ps, photons_ps, losses, sync}; }
  [[nodiscard]] double length_ns() const { return static_cast<double>(end_ps - start_ps) * 1e-3; }
  [[nodiscard]] std::int64_t middle_ps() const { return start_ps + (end_ps - start_ps) / 2; }
};

// What frames are made of: a simulated scene, or a recording.
struct FrameOrigin {
  std::string name;                       // for people: "the configured scene", or the file
  std::optional<SimulatorOptions> scene;  // absent: the recording
  std::string recording;                  // PTU file
  std::optional<SceneTruth> truth;        // of the scene's constants or of the recording
  ChannelOptions channels;                // of the tags
};

// The recording if one is named; otherwise the configured simulator's scene, the recording of a
// configured replay, or, for any other source, the default scene with the configured pattern and
// pulse width. A recording's truth is taken from FILE.truth.json (as `simulate` names it) if that
// is there.
//
// Errors: Error(Fault::data) where a truth file is there and cannot be read.
FrameOrigin find_origin(const Config& config, const std::string& recording);

using Warn = std::function<void(const std::string& sentence)>;

// The frame lengths to measure, ascending, of those asked for (empty: a tenth, two fifths, one and
// four times the configured one). Left out are those that this pattern cannot have to within a
// tenth, whose syncs do not fit the ring, and that a target on its way to the lidar leaves no time
// for; with a sentence to `warn` each.
//
// Errors: Error(Fault::usage) where none is left.
std::vector<double> possible_lengths_ms(const Config& config, const FrameOrigin& origin,
                                        std::vector<double> asked_ms, const Warn& warn);

// Called now and then with the number of frames so far.
using CollectProgress = std::function<void(std::size_t frames)>;

// `count` frames of about length_ms, cut by the framer as the daemon does, and the first frame of
// each run before them. Left out are frames that did not lock, of which too little was seen
// (frame.min_seen_fraction) or that the truth does not cover. Fewer come where a recording ends,
// where the photons take more than 256 MiB, and after a stop request.
//
// A scene is played from its start; one whose target comes closer at a constant speed is played
// again, with the next seed, before the target arrives.
//
// Threads: the caller's. Errors: those of the source; Error(Fault::data) where a recording has
// frames and none locks.
std::vector<KeptFrame> collect_frames(const Config& config, const FrameOrigin& origin,
                                      double length_ms, std::size_t count,
                                      const CollectProgress& progress, const std::stop_token& stop);

}  // namespace splid
