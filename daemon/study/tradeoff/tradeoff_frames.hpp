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

namespace splid::tradeoff {

// The state of a target at mid-frame.
struct TargetState {
  double delay_ns = 0;  // round trip, electronics included; not wrapped to the pattern's range
  double velocity_mps = 0;
};

// A frame that owns its tags, so that it can be estimated again and again.
struct KeptFrame {
  std::int64_t start_ps = 0;  // tagger's clock
  std::int64_t end_ps = 0;
  std::vector<std::int64_t> photons_ps;
  std::vector<Loss> losses;
  SyncFit sync;
  std::vector<std::int64_t> before_ps;  // the last photons before start_ps
  std::vector<std::uint64_t> photons_of_input;
  double seen_fraction = 0;
  bool first = false;                // the first frame of a run: estimated, but not judged
  std::optional<TargetState> truth;  // absent where the truth is not known

  [[nodiscard]] FrameView view() const {
    return {start_ps, end_ps, photons_ps, losses, sync, before_ps, photons_of_input};
  }
  [[nodiscard]] double length_ns() const { return static_cast<double>(end_ps - start_ps) * 1e-3; }
  [[nodiscard]] std::int64_t middle_ps() const { return start_ps + (end_ps - start_ps) / 2; }
};

// Where frames come from: a simulated scene or a recording.
struct FrameOrigin {
  std::string name;                         // for people: "the configured scene", or the file
  std::optional<simulator::Options> scene;  // absent: frames come from the recording
  std::string recording;                    // PTU file
  std::optional<SceneTruth> truth;          // of the scene's constants or of the recording
  ChannelOptions channels;                  // of the tags
};

// The origin of the frames. It is `recording`, if that is not empty; otherwise the scene of a
// configured simulator, the recording of a configured replay or, for any other source, the default
// scene with the configured pattern and pulse width. The truth of a recording is read from
// FILE.truth.json, as `splid simulate` names it, if that file exists.
//
// config: of one pixel, as config_of_pixel() makes it.
//
// Errors: Error(Fault::data) where the truth file exists and cannot be read; Error(Fault::usage)
// where a configured array lacks the pixel.
FrameOrigin find_origin(const Config& config, const std::string& recording);

using Warn = std::function<void(const std::string& sentence)>;

// The frame lengths to measure, ascending, from the lengths asked for (empty: 0.1, 0.4, 1 and 4
// times the configured length). A length is left out, with a sentence to `warn`, where no whole
// number of pattern periods comes within a tenth of it, where its syncs do not fit the ring, and
// where a target that comes towards the lidar leaves no time for such frames.
//
// Errors: Error(Fault::usage) where no length is left.
std::vector<double> possible_lengths_ms(const Config& config, const FrameOrigin& origin,
                                        std::vector<double> asked_ms, const Warn& warn);

// Called now and then with the number of frames collected so far.
using CollectProgress = std::function<void(std::size_t frames)>;

// Collects `count` frames of about length_ms, cut by the framer as in the daemon, and in addition
// the first frame of each run. It leaves out frames that did not lock, frames of which too little
// was seen (frame.min_seen_fraction), and frames that the truth does not cover. It returns fewer
// frames where a recording ends, where the photons take more than 256 MiB, and after a stop
// request.
//
// A scene is played from its start. A scene whose target comes closer at a constant speed ends
// before the target arrives, and is then played again with the next seed.
//
// Threads: the caller's. Errors: those of the source; Error(Fault::data) where a recording has
// frames and no frame locks.
std::vector<KeptFrame> collect_frames(const Config& config, const FrameOrigin& origin,
                                      double length_ms, std::size_t count,
                                      const CollectProgress& progress, const std::stop_token& stop);

}  // namespace splid::tradeoff
