#pragma once

#include <functional>
#include <memory>
#include <string>

#include "config/config.hpp"
#include "daemon/stream/frame_dealer.hpp"
#include "drivers/source.hpp"
#include "protocol/frame_json.hpp"

// The room daemon/study works on recordings and scenes at leisure. Read this header first: it makes
// frames of a source without publishing them. truth_score.hpp compares such frames with the truth;
// calibration/ and tradeoff/ are rooms of their own.

namespace splid {

// Frames of a recording for those who want them all and publish none.

// Makes `recording` the source of a configuration, and chooses the encoder counts: the file
// `counts`, if it is not empty, or else the file beside the recording, or else the configured file.
// Never a configured bridge, whose counts are of the present and not of the time of the recording.
// speed: as in ReplayOptions, where 0 is as fast as possible. Errors: none; where the file beside
// the recording has no counts, the log says so.
void read_from(const std::string& recording, const std::string& counts, double speed,
               Config& config);

// Takes each frame's message, in order; of several pixels those of a frame one after the other, in
// the order of the configuration.
using TakeFrame = std::function<void(const FrameMessage&)>;
// Asked between two frames, and at least twenty times a second. Returns false to end the stream.
using GoOn = std::function<bool()>;

// Measures a source from its begin to its end, as `splid replay` does: the same frames with the
// same messages to the last bit, but for compute_ms and latency_ms. The configured source is asked
// only for an encoder of its own. wanted: the frames that are estimated and taken; null: all. The
// other frames are framed alone, which takes less time, so that the bounds of the wanted
// frames, their references and all else that a frame has from the frames before it are the same.
//
// Threads: the caller's calls take() and go_on(), while those of a Stream measure; wanted() is
// called as FrameChoice says. Errors: those of Stream, of the source after all its frames were
// taken, and of open_encoder(); Error(Fault::data) where the source was measured to its end and no
// frame could lock although syncs came; what take() and go_on() throw.
void measure_frames(const Config& config, std::unique_ptr<TagSource> source, const TakeFrame& take,
                    const GoOn& go_on, FrameChoice wanted = nullptr);

}  // namespace splid
