#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "estimator/array/known_velocity.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/likelihood/maximizer.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid::array {

// How velocities hang together over the field: v = c_0 + c_1 x + c_2 y. A body that moves without
// turning has c_0 alone. One that turns adds omega x r, whose part along the line of sight is even
// in the place across it.
inline constexpr Eigen::Index most_terms = 3;
using Terms = Eigen::Vector3d;
using TermsMatrix = Eigen::Matrix3d;

// A pixel of a fit, and what the fit makes of it.
struct SharedPixel {
  std::size_t pixel = 0;
  const FrameView* frame = nullptr;
  Terms row = {1, 0, 0};  // 1, x, y
  double delay_ns = 0;    // D at mid-frame, in the pattern's clock, within two pulse widths
  double signal_per_pulse = 0, background_per_ns = 0;  // 0: not known
  double gain_nats = 0;                                // over no target, with the shared velocity
};

struct SharedMaximum {
  Terms terms = Terms::Zero();
  TermsMatrix covariance = TermsMatrix::Zero();
  bool has_covariance = false;  // false where the pixels do not tell the terms
  double more_nats = 0;         // that all terms together would gain, by the parabola here
};

// Maximizes the joint likelihood of pixels that share a velocity, each with a delay, a signal and a
// background of its own, by Newton's method. The Hessian is an arrow: each pixel is maximized alone
// at a given velocity, and adds its slope and its information (the Schur complement). Dead time is
// not in it: it moves delays, and not velocities.
class SharedFit {
 public:
  // reach_ns: of FoldedFrame.
  SharedFit(const PulseTrain& train, const PulseShape& shape, std::size_t max_photons,
            double reach_ns);

  // terms: how many are free, 1 or 3. start: each pixel's velocity within two pulse widths a frame.
  SharedMaximum fit(std::span<SharedPixel> pixels, Eigen::Index terms, const Terms& start);

 private:
  struct Sums {
    TermsMatrix information = TermsMatrix::Zero();
    Terms slope = Terms::Zero();
  };
  void add(SharedPixel& pixel, const Terms& at, Sums& sums);

  const PulseTrain& train_;
  FoldedFrame frame_;
  likelihood::Maximizer maximizer_;
  likelihood::Point point_;
};

}  // namespace splid::array
