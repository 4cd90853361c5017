#include "estimator/array/track_field.hpp"

#include <cmath>
#include <limits>

namespace splid::array {
namespace {

// After so many frames FrameEstimator searches a pixel anew.
constexpr std::size_t followed_frames = 20;

// A neighbour tells where a target is, and not how bright it is, nor how sure its range is: the
// frame looks at all delays that can be taken for the one that is found.
TargetTrack without_light(const TargetTrack& track, std::size_t pixel) {
  TargetTrack start = track;
  start.nats_per_ns = 0;
  start.odds_per_nat = 0;
  start.std_signal_per_pulse = std::numeric_limits<double>::infinity();
  start.followed = static_cast<int>(pixel % followed_frames);
  return start;
}

}  // namespace

TrackField::TrackField(std::span<const PixelDirection> directions)
    : neighbours_(directions, 1),
      tracks_(directions.size()),
      last_(directions.size()),
      is_helped_(directions.size()),
      is_spread_(directions.size()) {}

void TrackField::begin_frame() {
  helped_ = 0;
  forget_vain_help();
  last_ = tracks_;
  for (std::size_t k = 0; k < tracks_.size(); ++k) {
    is_helped_[k] = 0;
    if (last_[k].valid) {
      spread(k);
      continue;
    }
    const TargetTrack* other = neighbours_track(k);
    if (other == nullptr) continue;
    tracks_[k] = without_light(*other, k);
    is_helped_[k] = 1;
    ++helped_;
  }
}

// A pixel that was helped and saw nothing still has its neighbour's track, as it was.
void TrackField::forget_vain_help() {
  for (std::size_t k = 0; k < tracks_.size(); ++k) {
    if (is_helped_[k] == 0) continue;
    const bool has_seen = std::isfinite(tracks_[k].std_signal_per_pulse);
    if (!has_seen) tracks_[k] = {};
  }
}

// Pixels that are searched in the same frame are then searched anew in different ones.
void TrackField::spread(std::size_t pixel) {
  if (is_spread_[pixel] != 0 || tracks_[pixel].followed > 0) return;
  tracks_[pixel].followed = static_cast<int>(pixel % followed_frames);
  is_spread_[pixel] = 1;
}

const TargetTrack* TrackField::neighbours_track(std::size_t pixel) const {
  for (const std::size_t other : neighbours_.around(pixel, 1)) {
    if (last_[other].valid) return &last_[other];
  }
  return nullptr;
}

}  // namespace splid::array
