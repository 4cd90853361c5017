#include "estimator/array/pooled_scene.hpp"

namespace splid::array {
namespace {

// What a pool's light is for each of its pixels.
Estimate for_each_of(Estimate estimate, std::size_t pixels) {
  const double share = 1 / static_cast<double>(pixels);
  for (double* rate : {&estimate.signal_per_pulse, &estimate.std_signal_per_pulse,
                       &estimate.background_per_ns, &estimate.std_background_per_ns}) {
    *rate *= share;
  }
  for (TargetEstimate& target : estimate.targets) {
    target.signal_per_pulse *= share;
    target.std_signal_per_pulse *= share;
  }
  return estimate;
}

bool has_too_few(const Estimate& estimate) {
  return estimate.status == FrameStatus::no_target || estimate.status == FrameStatus::ambiguous;
}

}  // namespace

PooledScene::PooledScene(const Pattern& pattern, const PulseOptions& pulse,
                         const SceneOptions& scene, const EstimatorOptions& options,
                         double frame_length_ms, std::span<const PixelDirection> directions,
                         ClockReference reference)
    : neighbours_(directions, rings),
      estimator_(pattern, pulse, scene, options, frame_length_ms, most_photons, reference) {
  photons_ps_.reserve(most_photons);
}

std::size_t PooledScene::estimate(const PooledFrame& frame) {
  std::size_t count = 0;
  for (std::size_t k = 0; k < frame.estimates.size(); ++k) {
    frame.pooled[k] = 1;
    if (!has_too_few(frame.estimates[k])) continue;
    TargetTrack track;
    for (std::size_t ring = rings; ring > 0; --ring) {
      const Estimate pooled = pool(frame, k, ring, track);
      if (pooled.status == FrameStatus::not_run) continue;
      if (pooled.status != FrameStatus::ok) break;
      frame.estimates[k] = pooled;
      frame.estimates[k].photons = frame.frames[k].photons_ps.size();
      frame.pooled[k] = neighbours_.around(k, ring).size();
    }
    count += frame.pooled[k] > 1 ? 1 : 0;
  }
  return count;
}

Estimate PooledScene::pool(const PooledFrame& frame, std::size_t pixel, std::size_t ring,
                           TargetTrack& track) {
  const std::span<const std::size_t> around = neighbours_.around(pixel, ring);
  photons_ps_.clear();
  for (const std::size_t k : around) {
    const std::span<const std::int64_t> more = frame.frames[k].photons_ps;
    if (photons_ps_.size() + more.size() > most_photons) return {};
    photons_ps_.insert(photons_ps_.end(), more.begin(), more.end());
  }
  FrameView view = frame.frames[pixel];
  view.photons_ps = photons_ps_;
  view.before_ps = {};
  view.photons_of_input = {};
  return for_each_of(estimator_.estimate(view, &track), around.size());
}

}  // namespace splid::array
