#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/stream/frame.hpp"
#include "estimator/sync/sync_clock.hpp"
#include "protocol/options.hpp"
#include "protocol/pattern.hpp"
#include "protocol/scan_lines.hpp"

namespace splid {

// How long frames are, and how their syncs are fitted.
struct FramerOptions {
  double length_ms = 50;  // > 0
  double period_ps = 0;   // of the pattern, in the tagger's clock if it was calibrated; > 0
  DriftMethod drift = DriftMethod::regression;
  std::size_t max_syncs = 1 << 16;     // how many one frame can hold
  std::vector<NumberPair> walk = {};   // of the detector: see TimingWalk
  std::optional<ScanLines> scan = {};  // absent: frames are cut by time
};

// The pattern periods in a frame: the whole number that comes nearest to length_ms, at least 1.
double periods_per_frame(double length_ms, double period_ps);

// The options for a pattern: its period (calibrated, if it was calibrated) and room for its syncs.
// walk: `detector.walk`.
FramerOptions framer_options(double length_ms, const Pattern& pattern, DriftMethod drift,
                             const std::vector<NumberPair>& walk);

// A frame of a source that can wait, such as a replay, holds as many photons at least: its room
// grows. 128 MiB.
inline constexpr std::size_t most_waiting_photons = std::size_t{1} << 24;

// The photons that a frame can hold. live: the source cannot wait.
std::size_t most_photons(std::size_t ring_capacity, bool live);

// Room for as many photons as the ring can hold, which grows if the source is not live, and twice
// the syncs that the pattern sends. pixels: that share the room evenly, least_pixel_photons each at
// least, so that a pixel that never stops costs no other a photon.
FrameCapacity frame_capacity(double length_ms, const Pattern& pattern, std::size_t ring_capacity,
                             bool live, std::size_t pixels = 1);

inline constexpr std::size_t least_pixel_photons = 1024;

// Which pipeline.ring_capacity_tags gives room for a frame whose photons did not fit; 0 where they
// did. photons, lost_tags: of the frame; room: most_photons() of its source.
std::uint64_t ring_needed(std::uint64_t photons, std::uint64_t lost_tags, std::size_t room);
// Says so.
std::string advice_on_room(std::uint64_t ring_tags);

// Photons that the estimator has room for from its start: 40 M/s in 50 ms, what the fastest taggers
// deliver. A fuller frame makes the room larger.
inline constexpr std::size_t max_estimated_photons = std::size_t{1} << 21;

// Errors: Error(Fault::usage) where the syncs of a frame of length_ms alone, one for each pattern
// period, do not fit into a ring of ring_capacity tags.
void check_frame_fits(double length_ms, const Pattern& pattern, std::size_t ring_capacity);

}  // namespace splid
