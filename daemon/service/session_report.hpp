#pragma once

#include <string>

#include "daemon/pipeline/pipeline.hpp"
#include "protocol/messages.hpp"

namespace splid {

// What a run says of itself, for people. Threads: any.

// "frame 12, ok, 284.5000 m, -1.250 m/s".
std::string describe(const FrameMessage& message);

// "200 frames: 199 ok, 1 no_target; 1,234 tags: ...; 0 lost".
std::string describe(const PipelineSummary& summary);

// Errors: Error(Fault::data) where syncs were plenty, but no frame could lock to them. With few, or
// none, a warning in the log.
void check_locked(const PipelineSummary& summary);

}  // namespace splid
