#pragma once

#include <cmath>
#include <optional>

#include "protocol/frame_json.hpp"

namespace splid {

// A mean over the last frames of values that have deviations, each with the weight of its variance.
//
// A frame's weight falls by a 400th with each frame after it, so that the mean is that of the last
// 20 s where frames last 50 ms.
//
// Threads: one thread for each object. Errors: none.
class FrameMean {
 public:
  [[nodiscard]] double excess() const { return weights_ > 0 ? sum_ / weights_ : 0; }
  [[nodiscard]] double deviation() const { return weights_ > 0 ? 1 / std::sqrt(weights_) : 0; }
  // Whether the mean surely is another than 0, and by so much that it matters. Chance alone reaches
  // six deviations in two means of 10^9.
  [[nodiscard]] bool is_sure() const {
    return std::abs(excess()) >= least_ && std::abs(excess()) >= sure * deviation();
  }

 protected:
  explicit FrameMean(double least) : least_(least) {}
  void add(std::optional<double> value, std::optional<double> deviation) {
    weights_ *= kept_a_frame;
    sum_ *= kept_a_frame;
    if (!value || !deviation) return;
    const double weight = 1 / (*deviation * *deviation);
    weights_ += weight;
    sum_ += weight * *value;
  }

 private:
  static constexpr double kept_a_frame = 1 - 1.0 / 400;
  static constexpr double sure = 6;
  double least_;
  double weights_ = 0, sum_ = 0;
};

// The mean of how much wider the detected pulse appears than the configured one (`pulse_excess`).
// It shows what no single frame can: a surface half as bright 1 cm behind a target makes the pulse
// 5 % wider, which is 1.6 of a frame's deviations, and moves the distance by five. A width that is
// wrong by 3 % moves no value of a frame with a thousand signal photons by more than some tenth of
// its deviation.
class PulseMean : public FrameMean {
 public:
  PulseMean() : FrameMean(0.03) {}
  void add(const FrameMessage& frame) {
    FrameMean::add(frame.pulse_excess, frame.std_pulse_excess);
  }
};

// The mean of the skewness of a pulse whose width is fitted (`pulse_skew`). A surface half as
// bright 2 cm behind a target makes it 0.1, 1.2 of a frame's deviations, and moves the distance by
// eleven.
class SkewMean : public FrameMean {
 public:
  SkewMean() : FrameMean(0.05) {}
  void add(const FrameMessage& frame) { FrameMean::add(frame.pulse_skew, frame.std_pulse_skew); }
};

}  // namespace splid
