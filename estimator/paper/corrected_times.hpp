#pragma once

#include <vector>

#include "estimator/model/frame_view.hpp"

namespace splid::paper {

// A frame's photons in the pattern's own clock, from the frame's start on, by [P] Eq. 20; times in
// ns of the calibrated pattern, which `scale` turns into the tagger's.
struct CorrectedTimes {
  struct Span {
    double begin_ns, end_ns;  // from the frame's start
  };
  std::vector<double> time_ns;   // of each photon, in [0, length)
  std::vector<double> phase_ns;  // after the last pattern start, in [0, period)
  std::vector<Span> seen;        // the frame less its losses, ascending
  double period_ns = 0;          // of the pattern
  double start_phase_ns = 0;     // of the frame's start, in [0, period)
  double length_ns = 0;          // t_a
  double seen_ns = 0;            // sum of the spans' lengths
  double scale = 1;              // measured over calibrated period

  // view: locked to its syncs. period_ns: that of the calibrated pattern.
  CorrectedTimes(const FrameView& view, double period_ns);
};

}  // namespace splid::paper
