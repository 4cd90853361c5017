#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "estimator/checks/detector_waits.hpp"
#include "estimator/fold/near_set.hpp"
#include "estimator/model/estimate.hpp"
#include "estimator/model/frame_view.hpp"
#include "estimator/model/options.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"
#include "protocol/pattern.hpp"

namespace splid::checks {

// Judges the detector over the frames of a stream, by DetectorWaits: once a second, by what has
// come since a minute ago at most. Frames with losses, without a lock to their syncs, and of a
// detector that is split over several inputs say nothing. Of a frame up to 65,536 photons are
// looked at.
//
// Errors: none but the constructor's. add() allocates where a frame is fuller than all before it.
class DetectorWatch {
 public:
  // reference: whose clock the estimates' delays are in. inputs: that share the light.
  // Errors: Error(Fault::usage) where pattern and pulse do not fit together.
  DetectorWatch(const Pattern& pattern, const PulseOptions& pulse, const DetectorOptions& detector,
                ClockReference reference, std::size_t inputs);

  // A stream begins: what was before is forgotten.
  void clear();
  // estimate: of this frame.
  void add(const FrameView& frame, const Estimate& estimate);
  // As of the last second that is over.
  [[nodiscard]] const FoundList& found() const { return found_; }
  // With timing_walk found: the table for `detector.walk`; see DetectorWaits.
  [[nodiscard]] const std::vector<NumberPair>& walk() const { return walk_; }

 private:
  void add_returns(const FrameView& frame, const Estimate& estimate);

  PulseTrain train_;
  std::unique_ptr<PulseShape> shape_;
  ClockReference reference_;
  std::size_t inputs_;
  double reach_ns_;
  std::vector<CombWindow> windows_;
  FoldedFrame folded_;
  NearSet near_;  // returns, looked at where the train has one segment
  DetectorWaits waits_;
  std::vector<std::int64_t> times_ps_;  // of this frame, ascending
  double since_judged_ns_ = 0, since_clear_ns_ = 0;
  FoundList found_;
  std::vector<NumberPair> walk_;
};

}  // namespace splid::checks
