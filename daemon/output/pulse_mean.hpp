#pragma once

#include <cmath>

#include "protocol/frame_json.hpp"

namespace splid {

// The mean over the last frames of how much wider the detected pulse appears than the configured
// one (`pulse_excess`), each frame with the weight of its variance. It shows what no single frame
// can: a surface half as bright 1 cm behind a target makes the pulse 5 % wider, which is 1.6 of a
// frame's deviations, and moves the distance by five.
//
// A frame's weight falls by a 400th with each frame after it, so that the mean is that of the last
// 20 s where frames last 50 ms.
//
// Threads: one thread for each object. Errors: none.
class PulseMean {
 public:
  void add(const FrameMessage& frame) {
    weights_ *= kept_a_frame;
    sum_ *= kept_a_frame;
    if (!frame.pulse_excess || !frame.std_pulse_excess) return;
    const double weight = 1 / (*frame.std_pulse_excess * *frame.std_pulse_excess);
    weights_ += weight;
    sum_ += weight * *frame.pulse_excess;
  }

  [[nodiscard]] double excess() const { return weights_ > 0 ? sum_ / weights_ : 0; }
  [[nodiscard]] double deviation() const { return weights_ > 0 ? 1 / std::sqrt(weights_) : 0; }
  // Whether the pulse surely is another, and by so much that it matters. Chance alone reaches six
  // deviations in two means of 10^9. A width that is wrong by 3 % moves no value of a frame with a
  // thousand signal photons by more than some tenth of its deviation.
  [[nodiscard]] bool is_sure() const {
    return std::abs(excess()) >= least_excess && std::abs(excess()) >= sure * deviation();
  }

 private:
  static constexpr double kept_a_frame = 1 - 1.0 / 400;
  static constexpr double least_excess = 0.03;
  static constexpr double sure = 6;
  double weights_ = 0, sum_ = 0;
};

}  // namespace splid
