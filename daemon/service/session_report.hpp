#pragma once

#include <string>

#include "daemon/output/stream_summary.hpp"
#include "protocol/messages.hpp"

namespace splid {

// What a run says of itself, for people. Threads: any.

// "frame 12, ok, 284.5000 m, -1.250 m/s".
std::string in_words(const FrameMessage& message);

// "200 frames: 199 ok, 1 no_target; 1,234 tags: ...; 0 lost".
std::string in_words(const StreamSummary& summary);

// Errors: Error(Fault::data) where syncs were plenty, but no frame could lock to them. With few, or
// none, a warning in the log.
void check_locked(const StreamSummary& summary);

// A warning in the log where frames took longer to compute than they last, on so many threads.
void check_cost(const StreamSummary& summary, double threads);

// Errors: Error(Fault::data) where the photons of frames contradict the pattern, five times as many
// as were valid or more. Where fewer do, a warning in the log.
void check_pattern(const StreamSummary& summary);

}  // namespace splid
