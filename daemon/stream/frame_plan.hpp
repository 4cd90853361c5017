#pragma once

#include <cstddef>

#include "daemon/stream/frame.hpp"
#include "estimator/sync/sync_clock.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// How long frames are, and what they are made of.
struct FramerOptions {
  double length_ms = 50;  // > 0
  double period_ps = 0;   // of the pattern, in the tagger's clock where calibrated; > 0
  DriftMethod drift = DriftMethod::regression;
  std::size_t max_syncs = 1 << 16;  // that one frame can hold
};

// Pattern periods in a frame: the whole number that comes nearest to length_ms, at least one.
double periods_per_frame(double length_ms, double period_ps);

// Options for a pattern: its period, calibrated where it is, and room for its syncs.
FramerOptions framer_options(double length_ms, const Pattern& pattern, DriftMethod drift);

// Room for as many photons as the ring can hold, and twice the syncs that the pattern sends.
FrameCapacity frame_capacity(double length_ms, const Pattern& pattern, std::size_t ring_capacity);

// Errors: Error(Fault::usage) where the syncs alone of a frame of length_ms, one a pattern period,
// do not fit into a ring of ring_capacity tags.
void check_frame_fits(double length_ms, const Pattern& pattern, std::size_t ring_capacity);

}  // namespace splid
