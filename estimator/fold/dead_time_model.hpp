#pragma once

#include <cstddef>

#include "estimator/fold/dead_intervals.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/estimate.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

// Says of each frame whether the detector's dead time is part of what is fitted: where it moves a
// value by more than 0.05 deviations, and detections do not contradict it.
class DeadTimeModel {
 public:
  // Arguments: as for DeadIntervals.
  DeadTimeModel(const PulseTrain& train, double dead_time_ns, std::size_t inputs,
                std::size_t max_photons, double reach_ns);

  // Before the search: a dead time that lowers b or S is part of everything that is fitted. The
  // dead share of the time lowers both by as much of themselves. frame: the folded view, to which
  // its dead time is given.
  void look(const FrameView& view, FoldedFrame& frame);
  // After the search: gives the frame its dead time where the search did without and the pulses
  // turn out to be so bright that it matters. Returns whether it did, so that the fit is to be made
  // anew.
  bool look_at_pulses(const FrameView& view, FoldedFrame& frame, double signal_per_pulse);
  void say(const FoldedFrame& frame, Estimate& estimate) const;

 private:
  [[nodiscard]] double loss(const FoldedFrame& frame) const;
  [[nodiscard]] bool do_pulses_feel_it(const FoldedFrame& frame, double signal_per_pulse) const;
  void take(const FrameView& view, FoldedFrame& frame);

  const PulseTrain& train_;
  DeadIntervals dead_;
  bool holds_ = true;  // of the last frame: it is modelled, or too short to matter
};

}  // namespace splid
