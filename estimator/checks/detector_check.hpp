#pragma once

#include <cstddef>

#include "estimator/checks/afterpulse_check.hpp"
#include "estimator/checks/dead_time_check.hpp"
#include "estimator/checks/middle_photons.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/estimate.hpp"
#include "estimator/model/frame_view.hpp"

namespace splid {

// Says in an estimate what its photons show of the detector that the likelihood does not know: a
// dead time that is not given, or else afterpulses.
//
// Threads: one thread for each object. Errors: none. look() allocates nothing.
class DetectorCheck {
 public:
  // As for DeadTimeCheck and AfterpulseCheck.
  DetectorCheck(const PulseTrain& train, const PulseShape& shape, double dead_time_ns,
                std::size_t inputs, std::size_t max_photons)
      : dead_time_(train, shape, dead_time_ns, inputs),
        afterpulses_(train, shape, dead_time_ns, max_photons) {}

  // estimate: of this frame, with its values; gets the misfits, and a deviation of the background
  // that holds the afterpulses. Without a lock to the syncs nothing is said. folded: that frame.
  // to_reference: from the pattern's clock to that of the estimate.
  void look(const FrameView& frame, const FoldedFrame& folded, double to_reference,
            Estimate& estimate) {
    if (!frame.sync.locked) return;
    const auto times_ps = middle_.of(frame);
    estimate.dead_time_misfit_ns = dead_time_.misfit_ns(frame, times_ps, estimate);
    // Detections that are missing from one time and not from another change how many follow another
    // soon: the dead time comes first.
    if (!estimate.dead_time_misfit_ns) {
      afterpulses_.look(frame, times_ps, folded, to_reference, estimate);
    }
  }

 private:
  MiddlePhotons middle_;
  DeadTimeCheck dead_time_;
  AfterpulseCheck afterpulses_;
};

}  // namespace splid
