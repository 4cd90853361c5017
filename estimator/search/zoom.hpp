#pragma once

#include <cstdint>
#include <vector>

#include "estimator/fold/near_set.hpp"
#include "estimator/fold/search_kernels.hpp"

namespace splid {

// What a zoom ends with.
struct ZoomResult {
  DelayLine line;
  std::uint32_t count = 0;  // entries within box_ns / 2 of it
  double box_ns = 0;
};

// Within a near set, finds the line with the most entries by ever finer steps, from a search cell
// down to where the likelihood has a single hill (boxes of four pulse widths, moved by one).
//
// The set is cut into 32 slices with a histogram each; for every travel they are added along its
// line, so that the cost does not grow with the photons but for one pass a stage.
//
// Threads: one an object (scratch). No allocation in find() after the constructor.
class Zoom {
 public:
  // width_ns: PulseShape::width_ns; peak_offset_ns: where in the pulse most photons are.
  Zoom(double width_ns, double peak_offset_ns);

  // The line looked for is within `reach_ns` of near.line in delay and within 2 reach_ns in travel;
  // moving false keeps the travel.
  ZoomResult find(const NearSet& near, double reach_ns, bool moving);

 private:
  ZoomResult best_of(const NearSet& near, DelayLine about, double reach_ns, double step_ns,
                     bool moving);
  void fill(const NearSet& near, DelayLine about, double first_ns, double per_bin);

  static constexpr int max_steps = 32;  // delay steps on either side of the middle
  static constexpr int slices = 32;
  // On either side: the delays, what the ends of the steepest line move by, and a box.
  static constexpr int margin = 2 * max_steps + 4;
  static constexpr int bins = 2 * margin;

  const SearchKernels& kernels_;
  double width_ns_;
  double peak_offset_ns_;
  std::vector<std::uint32_t> rows_;    // slices * bins
  std::vector<std::uint32_t> counts_;  // bins
};

}  // namespace splid
