#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/array/neighbours.hpp"
#include "estimator/frame_estimator.hpp"

namespace splid::array {

// The pixels of a frame, as PooledScene takes and leaves them.
struct PooledFrame {
  // Of each pixel. All have the same begin, end, losses and syncs, and photons without the delay of
  // the pixel's cable.
  std::span<const FrameView> frames;
  std::span<Estimate> estimates;  // of each pixel, from FrameEstimator
  std::span<std::size_t> pooled;  // of how many pixels the estimate is; 1: of the pixel alone
};

// Estimates pixels that have too few photons from those of their neighbours together: scene `pool`.
// A pixel without a sure range gets the estimate of 3 x 3 pixels about it, or of 5 x 5 where these
// are too few; the widest pool comes first, as where it shows nothing there is nothing to refine.
// Rates are those of one pixel, on average; the distance is that of the surface that most of the
// pool sees. Errors: as FrameEstimator's constructor.
class PooledScene {
 public:
  static constexpr std::size_t rings = 2;  // 5 x 5
  // A pool of more photons is none of too few.
  static constexpr std::size_t most_photons = 1 << 17;

  // The arguments are those of FrameEstimator.
  PooledScene(const Pattern& pattern, const PulseOptions& pulse, const SceneOptions& scene,
              const EstimatorOptions& options, double frame_length_ms,
              std::span<const PixelDirection> directions,
              ClockReference reference = ClockReference::tagger);

  // Returns how many pixels have a pooled estimate.
  std::size_t estimate(const PooledFrame& frame);

 private:
  [[nodiscard]] Estimate pool(const PooledFrame& frame, std::size_t pixel, std::size_t ring,
                              TargetTrack& track);

  Neighbours neighbours_;
  FrameEstimator estimator_;
  std::vector<std::int64_t> photons_ps_;  // of a pool
};

}  // namespace splid::array
