#include "daemon/stream/frame_plan.hpp"

#include <fmt/core.h>

#include <algorithm>
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

FramerOptions framer_options(double length_ms, const Pattern& pattern, DriftMethod drift) {
  return {length_ms, tagger_period_ps(pattern), drift,
          2 * syncs_of_frame(length_ms, pattern) + more_syncs};
}

FrameCapacity frame_capacity(double length_ms, const Pattern& pattern, std::size_t ring_capacity) {
  FrameCapacity capacity;
  capacity.photons = ring_capacity;
  capacity.syncs = 2 * syncs_of_frame(length_ms, pattern) + more_syncs;
  return capacity;
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
