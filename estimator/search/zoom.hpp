#pragma once

#include <cstdint>
#include <vector>

#include "estimator/fold/near_set.hpp"
#include "estimator/fold/search_kernels.hpp"

namespace splid {

// The line that a zoom ends with.
struct ZoomResult {
  DelayTrack line;
  std::uint32_t count = 0;  // entries within box_ns / 2 of the line
  double box_ns = 0;
};

// Finds the line with the most entries of a near set, by ever finer steps: from a search cell down
// to boxes of four pulse widths that move by one width, at which the likelihood has a single
// maximum. Histograms of 32 slices of time are added along each line, so that each stage passes
// over the photons once.
class Zoom {
 public:
  // width_ns, peak_offset_ns: those of the PulseShape.
  Zoom(double width_ns, double peak_offset_ns);

  // The line with the most entries whose delay is within reach_ns of that of near.track, and whose
  // range walk is within 2 reach_ns of it. moving: false keeps the range walk.
  ZoomResult find(const NearSet& near, double reach_ns, bool moving);

 private:
  ZoomResult best_of(const NearSet& near, DelayTrack about, double reach_ns, double step_ns,
                     bool moving);
  void fill(const NearSet& near, DelayTrack about, double first_ns, double per_bin);

  static constexpr int max_steps = 32;  // delay steps on either side of the middle
  static constexpr int slices = 32;
  // Bins on either side of the middle: for the delays, for the ends of the steepest line, and for a
  // box.
  static constexpr int margin = 2 * max_steps + 4;
  static constexpr int bins = 2 * margin;

  const SearchKernels& kernels_;
  double width_ns_;
  double peak_offset_ns_;
  std::vector<std::uint32_t> rows_;    // slices * bins
  std::vector<std::uint32_t> counts_;  // bins
};

}  // namespace splid
