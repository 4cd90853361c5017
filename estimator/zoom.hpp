#pragma once

#include <cstdint>
#include <vector>

#include "estimator/folded_frame.hpp"

namespace splid {

// Within a near set, finds the line with the most entries by ever finer steps, from a search cell
// down to where the likelihood has a single hill (steps of two pulse widths).
//
// Threads: one an object (scratch). No allocation in find().
class Zoom {
 public:
  // width_ns: PulseShape::width_ns; peak_offset_ns: where in the pulse most photons are.
  Zoom(double width_ns, double peak_offset_ns);

  // The line looked for is within `reach_ns` of near.line in delay and within 2 reach_ns in drift;
  // moving false keeps the drift.
  DelayLine find(const NearSet& near, double reach_ns, bool moving);

 private:
  DelayLine best_of(const NearSet& near, DelayLine about, double reach_ns, double step_ns,
                    bool moving);

  static constexpr int max_steps = 16;  // delay steps on either side of the middle
  double width_ns_;
  double peak_offset_ns_;
  std::vector<std::uint32_t> counts_;
};

}  // namespace splid
