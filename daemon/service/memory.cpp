#include "daemon/service/memory.hpp"

#include <malloc.h>

#include <algorithm>
#include <bit>

#include "config/scan_options.hpp"
#include "daemon/stream/frame_plan.hpp"
#include "daemon/stream/lane.hpp"
#include "daemon/stream/stream.hpp"
#include "estimator/search_memory.hpp"

namespace splid {
namespace {

constexpr int large_bytes = 128 * 1024;

constexpr double bytes_a_mib = 1 << 20;
constexpr double program_mib = 19;           // with its libraries
constexpr double one_estimator_mib = 1.5;    // without the tables of its search
constexpr double estimator_bytes_a_tag = 4;  // that the ring holds

double frame_mib(const FrameCapacity& capacity) {
  const std::size_t parts = std::max<std::size_t>(capacity.pixels, 1);
  const std::size_t part_bytes =
      capacity.pixels * (sizeof(Frame) + sizeof(PixelEstimate) + capacity.losses * sizeof(Loss) +
                         2 * Frame::most_before * sizeof(std::int64_t));
  return static_cast<double>(part_bytes + parts * capacity.photons * sizeof(std::int64_t) +
                             capacity.syncs * sizeof(std::int64_t) +
                             capacity.markers * sizeof(MarkerTag) +
                             capacity.losses * sizeof(Loss)) /
         bytes_a_mib;
}

}  // namespace

double memory_needed_mib(const Config& config) {
  const auto ring = std::bit_ceil(static_cast<std::size_t>(config.pipeline.ring_capacity_tags));
  const double ring_mib = static_cast<double>(ring * sizeof(Tag)) / bytes_a_mib;
  // A recording has a ring of that size, and a scan a line.
  const int rings = 1 + (config.record.folder.empty() ? 0 : 1) +
                    (scan_lines(config.frame.by, config.scan, std::nullopt) ? 1 : 0);
  const auto tables = static_cast<double>(search_table_bytes(
      config.pattern, config.pulse, config.scene, config.estimator, config.frame.length_ms));
  const std::size_t pixels = config.pixels.size();
  const FrameCapacity capacity =
      frame_capacity(config.frame.length_ms, config.pattern, ring, true, pixels);
  const double lanes = pixels > 1 ? 1 : static_cast<double>(config.pipeline.estimation_threads);
  const double an_estimator_mib =
      one_estimator_mib +
      (estimator_bytes_a_tag * static_cast<double>(capacity.photons) + tables) / bytes_a_mib;
  return program_mib + ring_mib * rings + lanes * lane_depth * frame_mib(capacity) +
         static_cast<double>(estimators_needed(stream_options(config))) * an_estimator_mib;
}

void return_large_blocks() { (void)mallopt(M_MMAP_THRESHOLD, large_bytes); }

}  // namespace splid
