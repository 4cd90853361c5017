#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "estimator/fold/folded_frame.hpp"
#include "estimator/fold/near_set.hpp"
#include "estimator/model/estimate.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/options.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "protocol/fold_json.hpp"
#include "protocol/pattern.hpp"

namespace splid {

// Makes the pictures of a frame's photons (PhotonFold): folded on the pattern period ([P] Eq. 20)
// and moved back along the path of the estimate. They are for people: nothing of an estimate is
// made of them, and they are as fine as a screen.
//
// - stack: from -10 to 10 pulse widths about each pulse, beside what the estimate expects there:
//   its pulse, the neighbouring pulses and the background.
// - plane: 4 pulse widths of delay at mid-frame to either side, and the velocities at which a
//   target is 4 widths off at the ends of the frame. The gain is that of the estimate's signal and
//   background, so that it is the estimate's significance in the middle.
//
// Threads: one thread for each object, which holds scratch. Errors: none but the constructor's;
// fold() may allocate. Memory: as the fullest frame
// asks for.
class FrameFold {
 public:
  // reference: whose clock the estimates' delays are in.
  // Errors: Error(Fault::usage) where pattern and pulse do not fit together.
  FrameFold(const Pattern& pattern, const PulseOptions& pulse, ClockReference reference);

  // view: a frame, or every n-th photon of it; estimate: of the whole frame, whose `photons` tell
  // which share these are.
  PhotonFold fold(const FrameView& view, const Estimate& estimate);

 private:
  // The track of an estimate in the folded frame.
  [[nodiscard]] DelayTrack track_of(const Estimate& estimate) const;
  [[nodiscard]] PhotonFold::Period period_of(const FoldedFrame& frame, DelayTrack line) const;
  [[nodiscard]] PhotonFold::Stack stack_of(const FoldedFrame& frame, DelayTrack line,
                                           const Estimate& estimate, double share);
  [[nodiscard]] PhotonFold::Plane plane_of(const FoldedFrame& frame, DelayTrack line,
                                           const Estimate& estimate, double share);
  void add_light(const PulseTrain::Segment& segment, const CombWindow& window);
  [[nodiscard]] double density(double offset_ns) const;
  [[nodiscard]] double log_gain(DelayTrack line, double signal_over_background) const;

  PulseTrain train_;
  std::unique_ptr<PulseShape> shape_;
  ClockReference reference_;
  std::vector<CombWindow> windows_;
  std::vector<double> light_;      // expected in the bins of the stack: per ns of time, for S = 1
  std::vector<double> densities_;  // h, from the shape's first to its last
  FoldedFrame frame_, straight_, sample_;
  NearSet near_;
};

}  // namespace splid
