#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimator/array/neighbours.hpp"
#include "estimator/frame_estimator.hpp"
#include "tests/support/frame_maker.hpp"

namespace splid::test {

// The frames of an array of pixels, each before a surface of its own, one frame after the other.
class PixelField {
 public:
  static constexpr double way_m_per_ns = 0.299792458 / 2;

  // Rows of four pixels, all of one scene at first.
  PixelField(std::size_t pixels, const FrameMaker& made)
      : made_(pixels, made), directions_(pixels), frames_(pixels) {
    for (std::size_t k = 0; k < pixels; ++k) {
      directions_[k] = {0.1 * static_cast<double>(k % 4), 0.1 * static_cast<double>(k / 4)};
    }
  }

  FrameMaker& pixel(std::size_t k) { return made_[k]; }
  [[nodiscard]] std::size_t size() const { return made_.size(); }
  [[nodiscard]] const std::vector<array::PixelDirection>& directions() const { return directions_; }

  // Makes the next frame: after the first one, all surfaces have moved.
  const std::vector<FrameView>& next(std::uint64_t seed) {
    views_.clear();
    for (std::size_t k = 0; k < size(); ++k) {
      if (is_begun_) {
        const std::int64_t length_ps = frames_[k].end_ps - frames_[k].start_ps;
        made_[k].start_ps = frames_[k].end_ps;
        made_[k].distance_m += made_[k].velocity_mps * 1e-12 * static_cast<double>(length_ps);
      }
      frames_[k] = made_[k].make(seed * 1000 + k);
      views_.push_back(frames_[k].view());
    }
    is_begun_ = true;
    return views_;
  }

  [[nodiscard]] double velocity_error(const Estimate& estimate, std::size_t k) const {
    return estimate.velocity_mps - made_[k].velocity_mps;
  }
  [[nodiscard]] double distance_error(const Estimate& estimate, std::size_t k) const {
    const double period_ns = made_[k].pattern.segments.front().period_ps * 1e-3;
    return way_m_per_ns *
           std::remainder(estimate.delay_ns - made_[k].distance_m / way_m_per_ns, period_ns);
  }
  // Whether an estimate is the pixel's target, to within five of the estimate's deviations.
  [[nodiscard]] bool is_right(const Estimate& estimate, std::size_t k) const {
    return estimate.status == FrameStatus::ok &&
           std::abs(velocity_error(estimate, k)) < 5 * estimate.std_velocity_mps &&
           std::abs(distance_error(estimate, k)) < 5 * estimate.std_delay_ns * way_m_per_ns;
  }

 private:
  std::vector<FrameMaker> made_;
  std::vector<array::PixelDirection> directions_;
  std::vector<FrameMaker::Frame> frames_;
  std::vector<FrameView> views_;
  bool is_begun_ = false;
};

}  // namespace splid::test
