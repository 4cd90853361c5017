#include "daemon/stream/frame_plan.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "estimator/model/units.hpp"
#include "protocol/error.hpp"

namespace splid {
namespace {

constexpr std::size_t more_syncs = 1024;  // room for stray and doubled syncs of short frames

double tagger_period_ps(const Pattern& pattern) {
  return pattern.calibrated_period_ps.value_or(pattern_period_ps(pattern));
}

std::size_t syncs_of_frame(double length_ms, const Pattern& pattern) {
  return static_cast<std::size_t>(periods_per_frame(length_ms, tagger_period_ps(pattern)));
}

}  // namespace

double periods_per_frame(double length_ms, double period_ps) {
  return std::max(1.0, std::round(length_ms * ps_per_ms / period_ps));
}

FramerOptions framer_options(double length_ms, const Pattern& pattern, DriftMethod drift,
                             const std::vector<NumberPair>& walk) {
  return {length_ms, tagger_period_ps(pattern),
          drift,     2 * syncs_of_frame(length_ms, pattern) + more_syncs,
          walk,      {}};
}

std::size_t most_photons(std::size_t ring_capacity, bool live) {
  return live ? ring_capacity : std::max(ring_capacity, most_waiting_photons);
}

FrameCapacity frame_capacity(double length_ms, const Pattern& pattern, std::size_t ring_capacity,
                             bool live, std::size_t pixels) {
  FrameCapacity capacity;
  capacity.photons = ring_capacity;
  if (pixels > 1) {
    capacity.pixels = pixels;
    capacity.photons = std::max(least_pixel_photons, ring_capacity / pixels);
  }
  capacity.most_photons = live ? capacity.photons : most_photons(ring_capacity, live);
  capacity.syncs = 2 * syncs_of_frame(length_ms, pattern) + more_syncs;
  return capacity;
}

std::uint64_t ring_needed(std::uint64_t photons, std::uint64_t lost_tags, std::size_t room) {
  return photons < room || lost_tags == 0 ? 0 : std::bit_ceil(photons + lost_tags);
}

std::string advice_on_room(std::uint64_t ring_tags) {
  return fmt::format(
      "a frame had more photons than it has room for, and the rest are lost: raise "
      "pipeline.ring_capacity_tags to {} or more, or shorten frame.length_ms",
      ring_tags);
}

void check_frame_fits(double length_ms, const Pattern& pattern, std::size_t ring_capacity) {
  const std::size_t syncs = syncs_of_frame(length_ms, pattern);
  if (syncs <= ring_capacity) return;
  const double longest_ms =
      std::floor(static_cast<double>(ring_capacity) * tagger_period_ps(pattern) / ps_per_ms * 1e3) /
      1e3;
  throw Error(
      Fault::usage,
      fmt::format("/frame/length_ms: {:g} ms is {} pattern periods, each with a sync, and the ring "
                  "holds {} tags: shorten it to {:g} ms or less, or raise "
                  "/pipeline/ring_capacity_tags to {} or more",
                  length_ms, syncs, ring_capacity, longest_ms, syncs));
}

}  // namespace splid
