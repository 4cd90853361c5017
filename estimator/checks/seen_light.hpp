#pragma once

#include <array>
#include <span>
#include <vector>

#include "estimator/checks/residual_map.hpp"
#include "estimator/fold/dead_intervals.hpp"
#include "estimator/fold/folded_frame.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid::checks {

// Of each part of a frame, how much of it was seen, over the mean of all.
using SeenParts = std::array<double, map_parts>;

SeenParts seen_parts(const FrameView& view);

// The share of a frame's light that the detector could see; 1 is all that came in the time seen.
struct SeenLight {
  SeenParts of_part;
  std::array<double, most_cells> of_cell;  // at each offset about a pulse
  double elsewhere = 1;                    // on average outside of the map
  std::vector<double> of_phase;            // in each phase bin of the map; empty: alike
  std::vector<double> of_pulse;            // of each pulse of the train; empty: alike
  SeenLight() {
    of_part.fill(1);
    of_cell.fill(1);
  }
};

// Finds it for frames with their dead time. A detector is dead where a detection came within the
// dead time before: how often that is at a phase follows from the detections at earlier phases.
class SeenLightFinder {
 public:
  // map: as it will be filled. dead_time_ns: 0 where none is modelled.
  SeenLightFinder(const PulseTrain& train, const ResidualMap& map, double dead_time_ns);
  // map: of this frame.
  const SeenLight& look(const FoldedFrame& frame, const ResidualMap& map, const SeenParts& parts);

 private:
  void see_cells(const FoldedFrame& frame, const ResidualMap& map);
  void see_phases(const FoldedFrame& frame, const ResidualMap& map);

  const PulseTrain& train_;
  double pulses_before_ = 0;  // of a pulse, within the dead time, on average
  SeenLight seen_;
};

}  // namespace splid::checks
