#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/checks/residual_map.hpp"
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
  // Of each pulse of the train, 0 where the detector comes back within the pulse; empty: alike.
  std::vector<double> of_pulse;
  SeenLight() {
    of_part.fill(1);
    of_cell.fill(1);
  }
};

// Finds it for frames with their dead time. A detector is dead where a detection came within the
// dead time before: how often that is at a phase of a comb follows from the detections at earlier
// phases, whichever target they are of.
class SeenLightFinder {
 public:
  // map: as it will be filled. width_ns: of the pulse. dead_time_ns: 0 where none is modelled.
  SeenLightFinder(const PulseTrain& train, const ResidualMap& map, double width_ns,
                  double dead_time_ns);
  // map: of this frame.
  const SeenLight& look(const FoldedFrame& frame, const ResidualMap& map, const SeenParts& parts);

 private:
  void count(std::span<const std::uint32_t> phases_32, std::size_t segment);
  [[nodiscard]] double detected(std::size_t segment, double from_ns, double to_ns) const;
  // The share of the light at a phase of a segment's comb that the detector could see.
  [[nodiscard]] double seen_at(std::size_t segment, double phase_ns) const;
  void see_cells(const ResidualMap& map);

  const PulseTrain& train_;
  const FoldedFrame* frame_ = nullptr;
  std::vector<std::vector<std::uint32_t>> passed_;  // of each segment: detections before each bin
  SeenLight seen_;
};

}  // namespace splid::checks
