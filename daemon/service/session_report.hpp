#pragma once

#include <string>

#include "daemon/output/stream_summary.hpp"
#include "protocol/frame_json.hpp"

namespace splid {

// Sentences about a run, for people. Threads: any.

// "frame 12, ok, 284.5000 m, -1.250 m/s".
std::string in_words(const FrameMessage& message);

// "200 frames: 199 ok, 1 no_target; 1,234 tags: ...; 0 lost".
std::string in_words(const StreamSummary& summary);

// Errors: Error(Fault::data) where there were plenty of syncs and no frame could lock to them.
// Where there were few syncs, or none, the log has a warning.
void check_locked(const StreamSummary& summary);

// A warning in the log where frames took longer to compute than they last, on so many threads.
void check_cost(const StreamSummary& summary, double threads);

// Errors: Error(Fault::data) where the photons of frames contradict the pattern, in at least five
// times as many frames as were valid. Where they do in fewer frames, the log has a warning.
void check_pattern(const StreamSummary& summary);

}  // namespace splid
