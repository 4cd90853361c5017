#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "daemon/stream/lane.hpp"
#include "estimator/array/pooled_scene.hpp"
#include "estimator/array/rigid_scene.hpp"
#include "protocol/pixel.hpp"

namespace splid {

struct StreamOptions;

// Estimates the pixels of a frame together, once each has been estimated alone: scene `rigid`, and
// then scene `pool`.
//
// Threads: one thread for each object. Errors: Error(Fault::usage) from the constructor, where the
// pixels do not fit the scene.
class FieldEstimator {
 public:
  FieldEstimator(const StreamOptions& options, std::size_t max_photons);
  // Whether a scene asks for it.
  static bool is_wanted(const StreamOptions& options);

  void estimate(EstimationUnit& unit);

 private:
  std::optional<array::RigidScene> rigid_;
  std::optional<array::PooledScene> pool_;
  std::vector<FrameView> views_;
  std::vector<Estimate> estimates_;
  std::vector<int> bodies_;
  std::vector<std::size_t> pooled_;
};

}  // namespace splid
