#include "daemon/service/memory.hpp"

#include <malloc.h>

#include <algorithm>
#include <bit>

#include "daemon/stream/frame_plan.hpp"
#include "daemon/stream/lane.hpp"

namespace splid {
namespace {

constexpr int large_bytes = 128 * 1024;

constexpr double bytes_a_mib = 1 << 20;
constexpr double program_mib = 17;  // with its libraries
constexpr double estimator_mib = 2;
// Of a search over velocities; less where the fastest target moves less than that in a frame.
constexpr double search_mib = 12;
constexpr double widest_m = 0.05 * 150;

double frame_mib(const FrameCapacity& capacity) {
  return static_cast<double>(
             capacity.photons * sizeof(std::int64_t) + capacity.syncs * sizeof(std::int64_t) +
             capacity.markers * sizeof(MarkerTag) + capacity.losses * sizeof(Loss)) /
         bytes_a_mib;
}

}  // namespace

double memory_needed_mib(const Config& config) {
  const auto ring = std::bit_ceil(static_cast<std::size_t>(config.pipeline.ring_capacity_tags));
  const double ring_mib = static_cast<double>(ring * sizeof(Tag)) / bytes_a_mib;
  const double moved_m = config.scene.motion == Motion::static_target
                             ? 0
                             : config.frame.length_ms / 1000 * config.scene.max_speed_mps;
  const double lane_mib =
      lane_depth * frame_mib(frame_capacity(config.frame.length_ms, config.pattern, ring)) +
      estimator_mib + search_mib * std::min(1.0, moved_m / widest_m);
  return program_mib + ring_mib * (config.record.folder.empty() ? 1 : 2) +
         static_cast<double>(config.pipeline.estimation_threads) * lane_mib;
}

void return_large_blocks() { (void)mallopt(M_MMAP_THRESHOLD, large_bytes); }

}  // namespace splid
