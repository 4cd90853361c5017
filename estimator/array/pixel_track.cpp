#include "estimator/array/pixel_track.hpp"

#include <cmath>
#include <limits>

namespace splid::array {
namespace {

// A neighbour tells where a target is, and not how bright it is, nor how sure its range is: the
// frame looks at all delays that can be taken for the one that is found.
TargetTrack without_light(const TargetTrack& track) {
  TargetTrack start = track;
  start.nats_per_ns = 0;
  start.odds_per_nat = 0;
  start.std_signal_per_pulse = std::numeric_limits<double>::infinity();
  return start;
}

}  // namespace

TargetTrack PixelTrack::seen() const {
  const bool is_neighbours = !std::isfinite(track_.std_signal_per_pulse);
  return is_neighbours ? TargetTrack{} : track_;
}

void PixelTrack::begin_frame(const TargetTrack& help) {
  track_ = seen();
  const auto first = static_cast<int>(pixel_ % most_followed);
  if (!track_.valid && help.valid) {
    track_ = without_light(help);
    track_.followed = first;
  } else if (track_.valid && track_.followed == 0 && !is_spread_) {
    track_.followed = first;
    is_spread_ = true;
  }
}

TargetTrack help_of(const Neighbours& neighbours, std::size_t pixel,
                    std::span<const TargetTrack> seen) {
  for (const std::size_t other : neighbours.around(pixel, 1).subspan(1)) {
    if (seen[other].valid) return seen[other];
  }
  return {};
}

}  // namespace splid::array
