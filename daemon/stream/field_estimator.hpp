#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "daemon/stream/lane.hpp"
#include "estimator/array/pixel_track.hpp"
#include "estimator/array/pooled_scene.hpp"
#include "estimator/array/rigid_scene.hpp"
#include "protocol/pixel.hpp"

namespace splid {

struct StreamOptions;

// Estimates the pixels of a frame together, once each has been estimated alone: scene `rigid`, and
// then scene `pool`. Where pixels follow their targets, it tells each what its neighbours have
// seen.
//
// Threads: one thread for each object. Errors: Error(Fault::usage) from the constructor, where the
// pixels do not fit the scene.
class FieldEstimator {
 public:
  FieldEstimator(const StreamOptions& options, std::size_t max_photons);
  // Whether the options ask for any of this.
  static bool is_wanted(const StreamOptions& options);
  // Whether pixels are told what their neighbours have seen.
  static bool helps(const StreamOptions& options);

  void estimate(EstimationUnit& unit);

 private:
  void join(EstimationUnit& unit);
  void tell_neighbours(EstimationUnit& unit);

  std::optional<array::RigidScene> rigid_;
  std::optional<array::PooledScene> pool_;
  std::optional<array::Neighbours> helping_;
  std::vector<FrameView> views_;
  std::vector<Estimate> estimates_;
  std::vector<int> bodies_;
  std::vector<std::size_t> pooled_;
  std::vector<TargetTrack> seen_;
};

}  // namespace splid
