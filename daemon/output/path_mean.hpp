#pragma once

#include <cmath>

#include "protocol/frame_json.hpp"

namespace splid {

// The mean square, over the last frames, of by how much the target's path appears to be another
// than the fitted one (`path_excess`). It is 1 where the path is right, and shows what no single
// frame can: a change of the acceleration that puts each velocity off by three of its deviations is
// 1.3 of its own in a frame. Its sign may be another in each frame, so that a mean would not do.
//
// A frame's weight falls by a 400th with each frame after it, as in PulseMean.
//
// Threads: one thread for each object. Errors: none.
class PathMean {
 public:
  void add(const FrameMessage& frame) {
    weights_ *= kept_a_frame;
    squared_weights_ *= kept_a_frame * kept_a_frame;
    sum_ *= kept_a_frame;
    fitted_ *= kept_a_frame;
    if (!frame.path_excess) return;
    weights_ += 1;
    squared_weights_ += 1;
    sum_ += *frame.path_excess * *frame.path_excess;
    fitted_ += frame.acceleration_mps2 ? 1 : 0;
  }

  // The root of the mean square; 1 where no frame was added.
  [[nodiscard]] double excess() const { return weights_ > 0 ? std::sqrt(sum_ / weights_) : 1; }
  // Whether most of the frames have an acceleration.
  [[nodiscard]] bool is_of_bent_paths() const { return 2 * fitted_ > weights_; }
  // Whether the path surely is another. The mean is distributed as chi squared with a degree of
  // freedom for each frame, whose cube root is normal (Wilson and Hilferty), so that chance makes
  // one mean of 10^9 sure.
  [[nodiscard]] bool is_sure() const {
    if (weights_ <= 0) return false;
    const double variance = 2 * squared_weights_ / (9 * weights_ * weights_);
    return std::cbrt(sum_ / weights_) > 1 - variance + sure * std::sqrt(variance);
  }

 private:
  static constexpr double kept_a_frame = 1 - 1.0 / 400;
  static constexpr double sure = 6;
  double weights_ = 0, squared_weights_ = 0, sum_ = 0, fitted_ = 0;
};

}  // namespace splid
